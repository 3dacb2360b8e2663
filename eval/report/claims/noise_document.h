#pragma once

// What `sextant report` says: statements, errors by noise level with their growth, estimators compared, and
// the noise that was achieved.

#include <filesystem>
#include <vector>

#include "sextant/eval/report/document.h"

namespace sextant {

/// Of runs and sweeps together. Without sections when no pair has truth. Throws Error on bad folders.
ReportDocument noise_document(const std::vector<std::filesystem::path>& folders, int jobs, bool quiet = true,
                              const std::filesystem::path& out = {});

}  // namespace sextant
