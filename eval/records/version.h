#pragma once

// What this program was built from.

#include <string>

namespace sextant {

std::string version();
/// Commit of the source tree, with "-dirty" when it had changes; "unknown" outside git.
std::string git_commit();

}  // namespace sextant
