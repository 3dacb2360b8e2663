#pragma once

// A synthetic scenario as a sequence: what the adapters `synthetic` and `replay-*` have in common. Frames are
// rendered when asked for and kept on disk for the next run.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/synthetic/scenario.h"

namespace sextant {

struct RenderCacheOptions {
  SEXTANT_OPTIONS(
      (std::string, cache, "auto", "folder",
       "where rendered images are kept for the next run (14 MB a frame with all channels); 'auto' is $SEXTANT_CACHE/frames or ~/.cache/sextant/frames; empty keeps nothing; delete it to make room"),
      (int, cache_max_mb, 4096, "MB", "nothing more is kept once the folder holds this much"))
  void check() const { check_option(cache_max_mb >= 0, "cache_max_mb", cache_max_mb, ">= 0"); }
};

struct RenderedSource {
  SequenceInfo info;  ///< dataset, sequence, frames, rate, warnings; camera, size and channels are set here
  synthetic::Scenario scenario;
  int first_scenario_frame = 0;        ///< the data set's number of the scenario's frame 0
  std::optional<SequenceTruth> truth;  ///< where it comes from elsewhere than the scenario
};

/// `make` may log the files that it reads. Throws what `make` throws, and Error on a scenario that cannot be.
std::unique_ptr<Sequence> open_rendered(const std::function<RenderedSource(InputLog&)>& make,
                                        const RenderCacheOptions& options);

}  // namespace sextant
