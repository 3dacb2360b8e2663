#pragma once

// A synthetic scenario as a sequence: what the adapters `synthetic` and `replay-*` have in common. Frames are
// rendered when asked for and kept on disk for the next run.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/kitti_truth.h"
#include "sextant/datasets/synthetic/scenario.h"

namespace sextant {

struct RenderCacheOptions {
  SEXTANT_OPTIONS(
      (std::string, cache, "auto", "folder",
       "where rendered images are kept for the next run (14 MB a frame with all channels); 'auto' is "
       "$SEXTANT_CACHE/frames or ~/.cache/sextant/frames; empty keeps nothing; delete it to make room"),
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

// Adapter `synthetic`: rendered scenes that need no download (datasets/synthetic/). SOURCE is
// synthetic:<scenario>[@first-last]; depth, flow, masks and truth are exact. With every = n the sequence
// consists of the scenario's frames 0, n, 2n, .. and is called <scenario>/every<n>: larger motion between
// frames at a frame rate that is n times lower.

struct SyntheticOptions : RenderCacheOptions {
  SEXTANT_OPTIONS_OF(RenderCacheOptions,
      (int, every, 1, "count", "n: use only every n-th frame of the scenario, so that motions are n times as large"))
  void check() const;
};

/// Throws Error on an unknown scenario or option, a '#' in the source, or frames that it does not have.
std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source);

// Adapters `replay-vkitti1` and `replay-kitti`: the true motions of a real sequence, from its text files
// alone, as a rendered scene. Camera and objects move exactly as the truth says; cars of the boxes' sizes
// drive on a street that is made along their ways. Depth, flow and masks are exact, so the geometry of a data
// set can be measured without its images.
//
//   replay-vkitti1:DIR#0018[/clone]@124-134   DIR as in vkitti1.h
//   replay-kitti:ROOT#0003@0-30               ROOT/training/{calib,oxts,label_02}, and instances_txt for the
//                                             size of the images where it is there
//
// What is ours: the shapes within the boxes, the street, and that nothing else stands in the way; so masks
// are a little smaller than the boxes, and objects hide one another but nothing else hides them. Pedestrians
// and cyclists move as rigid bodies.

struct ReplayVkitti1Options {
  SEXTANT_OPTIONS(
      (double, rate_hz, 10, "Hz", "frame rate"),
      (double, bf, 725.0 * 0.532725, "px m",
       "focal length times baseline, for models of depth noise and the right image"),
      (RenderCacheOptions, render, {}, "", "images kept for the next run"))
  void check() const;
};

struct ReplayKittiOptions : KittiTruthOptions {
  SEXTANT_OPTIONS_OF(KittiTruthOptions,
      (double, rate_hz, 10, "Hz", "frame rate"),
      (RenderCacheOptions, render, {}, "", "images kept for the next run"))
  void check() const;
};

/// Throw Error on text files or frames that are not there or not as described.
std::unique_ptr<Sequence> open_replay_vkitti1(const SourceSpec& source);
std::unique_ptr<Sequence> open_replay_kitti(const SourceSpec& source);

}  // namespace sextant
