#pragma once

// By what, on which machine and from which inputs the records of a report were made: from the run.json of its
// parts. Same folders, same lines.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/report/evidence.h"

namespace sextant {

/// Parts lie in `parts/<name>`. What several parts agree in is said once.
std::vector<std::pair<std::string, std::string>> reproduction_provenance(const std::filesystem::path& parts,
                                                                         const Evidence& evidence);

}  // namespace sextant
