#pragma once

// A synthetic scenario as a sequence: the common part of the adapters `synthetic` and `replay-*`. Frames are
// rendered on demand and cached on disk.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/kitti_truth.h"
#include "sextant/datasets/synthetic/scenario.h"

namespace sextant {

namespace synthetic {
/// Returns the key of a scenario's images in the cache: the SHA-256 of everything that determines them, and
/// of the renderer's `version`.
std::string content_key(const Scenario& scenario, const std::string& version);
}  // namespace synthetic

struct RenderCacheOptions {
  SEXTANT_OPTIONS(
      (std::string, cache, "auto", "folder",
       "cache of rendered images for later runs (13 MB per frame with all channels); 'auto' is "
       "$SEXTANT_CACHE/frames or ~/.cache/sextant/frames; empty disables the cache; the folder may be "
       "deleted at any time"),
      (int, cache_max_mb, 4096, "MB", "no more images are cached once the folder has this size"))
  void check() const { check_option(cache_max_mb >= 0, "cache_max_mb", cache_max_mb, ">= 0"); }
};

struct RenderedSource {
  /// data set, sequence, frames, warnings, provenance; open_rendered() adds camera, rate, size and channels
  SequenceInfo info;
  synthetic::Scenario scenario;
  int first_scenario_frame = 0;        ///< number in the data set of the scenario's frame 0
  std::optional<SequenceTruth> truth;  ///< nullopt: rendered from the scenario
};

/// Opens the sequence that `make` describes; `make` may log the files that it reads. Throws Error for an
/// invalid scenario and for a cache folder that other users own or can write into, and whatever `make`
/// throws.
std::unique_ptr<Sequence> open_rendered(const std::function<RenderedSource(InputLog&)>& make,
                                        const RenderCacheOptions& options);

// Adapter `synthetic`: rendered scenes that need no download (datasets/synthetic/). SOURCE is
// synthetic:<scenario>[@first-last]; depth, flow, masks and truth are exact. With every = n the sequence
// consists of the scenario's frames 0, n, 2n, .. and is called <scenario>/every<n>: larger motion between
// frames at a frame rate that is n times lower.

struct SyntheticOptions : RenderCacheOptions {
  SEXTANT_OPTIONS_OF(RenderCacheOptions,
                     (int, every, 1, "count",
                      "n: use only every n-th frame of the scenario, so that motions are n times as "
                      "large"))
  void check() const;
};

/// Throws Error on an unknown scenario or option, a '#' in the source, or frames outside the scenario.
std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source);

// Adapters `replay-vkitti1` and `replay-kitti`: the true motions of a real sequence, from its text files
// only, as a rendered scene. Camera and objects move exactly as in the truth; cars with the sizes of the
// label boxes drive on a street that is generated along the path of the camera. Depth, flow and masks are
// exact, so that the geometry of a data set can be evaluated without its images.
//
//   replay-vkitti1:DIR#0018[/clone]@124-134   DIR as in vkitti1.h
//   replay-kitti:ROOT#0003@0-30               ROOT/training/{calib,oxts,label_02}, and instances_txt for the
//                                             size of the images if it exists
//
// The shapes within the boxes and the street are synthetic, and there are no objects without a label. Masks
// are therefore a little smaller than the boxes, and objects are mainly occluded by each other: no building
// or tree stands on the line from the camera to an object within 60 m. Pedestrians and cyclists move as rigid
// bodies.

struct ReplayVkitti1Options {
  SEXTANT_OPTIONS((double, rate_hz, 10, "Hz", "frame rate"),
                  (double, bf, 725.0 * 0.532725, "px m",
                   "focal length times baseline, for models of depth noise and the right image"),
                  (RenderCacheOptions, render, {}, "", "cache of rendered images"))
  void check() const;
};

struct ReplayKittiOptions : KittiTruthOptions {
  SEXTANT_OPTIONS_OF(KittiTruthOptions, (double, rate_hz, 10, "Hz", "frame rate"),
                     (RenderCacheOptions, render, {}, "", "cache of rendered images"))
  void check() const;
};

/// Throw Error on text files or frames that are missing or not as described.
std::unique_ptr<Sequence> open_replay_vkitti1(const SourceSpec& source);
std::unique_ptr<Sequence> open_replay_kitti(const SourceSpec& source);

}  // namespace sextant
