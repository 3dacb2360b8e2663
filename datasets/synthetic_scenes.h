#pragma once

// Adapter `synthetic`: rendered scenes that need no download (datasets/synthetic/). SOURCE is
// synthetic:<scenario>[@first-last]; depth, flow, masks and truth are exact.

#include <memory>
#include <string>

#include "sextant/datasets/dataset.h"

namespace sextant {

struct SyntheticOptions {
  std::string cache = "auto";
  int cache_max_mb = 4096;

  template <typename V>
  void visit(V& v) {
    v("cache", cache, "folder",
      "where rendered images are kept for the next run (14 MB a frame with all channels); 'auto' is "
      "$XDG_CACHE_HOME/sextant or ~/.cache/sextant; empty keeps nothing; delete it to make room");
    v("cache_max_mb", cache_max_mb, "MB", "nothing more is kept once the folder holds this much");
  }
  void check() const { check_option(cache_max_mb >= 0, "cache_max_mb", cache_max_mb, ">= 0"); }
};

/// Throws Error on an unknown scenario or option, a '#' in the source, or frames that it does not have.
std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source);

}  // namespace sextant
