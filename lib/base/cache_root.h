#pragma once

#include <filesystem>

namespace sextant {

/// Where what can be made again is kept: $SEXTANT_CACHE, else $XDG_CACHE_HOME/sextant, else ~/.cache/sextant.
/// Empty when SEXTANT_CACHE is set to nothing (keep nothing) or none of them is known.
std::filesystem::path cache_root();

}  // namespace sextant
