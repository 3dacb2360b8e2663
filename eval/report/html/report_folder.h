#pragma once

// All files of a report folder; the layout stands in document.h.

#include "sextant/eval/report/document.h"

namespace sextant {

struct ReportFolderOptions {
  bool draw_figures = true;  ///< off: tables alone, no report.md and no report.html
  int jobs = 1;              ///< threads that draw; the bytes do not depend on it
  bool quiet = true;         ///< no progress of the drawing
};

OutputFiles report_folder(const ReportDocument& document, const ReportFolderOptions& options);

/// report.html alone, for a folder that has other files.
std::string report_page(const ReportDocument& document, int jobs);

}  // namespace sextant
