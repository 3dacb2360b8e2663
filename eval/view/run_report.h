#pragma once

// report.html, with which a run ends: what came out in a sentence, the summary, errors over time, paths from above,
// distributions, the three worst frames of each body as pictures, where it comes from, and the line that opens the
// page to walk through it. One file that needs nothing else; links into that page work once the line has been run.
// Same run, same bytes, wherever its folder is.

#include <string>

#include "sextant/eval/report/document.h"
#include "sextant/eval/view/worst_frames.h"

namespace sextant {

struct RunReportRequest {
  const RunConfig& config;
  const RunResult& result;
  const MetricPreset& preset;
  std::string data_root;  ///< for the line, where the user has to say it again; else empty
};

/// `worst` has watched the run. Sources that it has not seen, because an earlier run had done them, go through the
/// estimator again here, with their first seed.
ReportDocument run_document(const RunReportRequest& request, WorstFrames& worst);

}  // namespace sextant
