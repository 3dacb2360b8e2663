#pragma once

// The report of `sextant report`: statements of the paper, errors by noise level and their growth,
// comparisons of estimators, and the noise that was achieved.

#include <filesystem>
#include <vector>

#include "sextant/eval/report/html/html.h"

namespace sextant {

/// Makes the report of runs and sweeps together. It has no sections if no pair has truth. Throws Error on
/// bad folders.
ReportDocument noise_document(const std::vector<std::filesystem::path>& folders, int jobs, bool quiet = true,
                              const std::filesystem::path& out = {});

/// Makes the report and writes it as a report folder into `out`, unless `out` is empty. Throws Error on bad
/// folders and if no pair has truth.
ReportDocument report_sweeps(const std::vector<std::filesystem::path>& folders,
                             const std::filesystem::path& out, const ReportFolderOptions& options);

}  // namespace sextant
