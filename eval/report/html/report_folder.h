#pragma once

// All files of a report folder; the layout stands in document.h.

#include "sextant/eval/report/document.h"

namespace sextant {

struct ReportFolderOptions {
  bool draw_figures = true;  ///< off: tables alone, no report.md and no report.html
  int jobs = 1;              ///< threads that draw; the bytes do not depend on it
};

OutputFiles report_folder(const ReportDocument& document, const ReportFolderOptions& options);

}  // namespace sextant
