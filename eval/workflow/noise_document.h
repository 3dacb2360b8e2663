#pragma once

// What `sextant report` says: statements, errors by noise level with their growth, estimators compared, and
// the noise that was achieved.

#include <filesystem>
#include <vector>

#include "sextant/eval/report/html/html.h"

namespace sextant {

/// The document of `sextant report`, of runs and sweeps together. It has no sections when no pair has truth.
/// Throws Error on bad folders.
ReportDocument noise_document(const std::vector<std::filesystem::path>& folders, int jobs, bool quiet = true,
                              const std::filesystem::path& out = {});

/// The document, written as a report folder into `out` unless that is empty. Throws Error on bad folders and
/// where no pair has truth.
ReportDocument report_sweeps(const std::vector<std::filesystem::path>& folders,
                             const std::filesystem::path& out, const ReportFolderOptions& options);

}  // namespace sextant
