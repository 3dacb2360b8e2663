#include "sextant/base/cache_root.h"

#include <cstdlib>

#include "sextant/base/files.h"

namespace sextant {

fs::path cache_root() {
  if (const char* own = std::getenv("SEXTANT_CACHE")) return own;
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && *cache == '/') return fs::path(cache) / "sextant";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return fs::path(home) / ".cache" / "sextant";
  return {};
}

}  // namespace sextant
