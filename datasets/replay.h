#pragma once

// Adapters `replay-vkitti1` and `replay-kitti`: the true motions of a real sequence, from its text files
// alone, as a rendered scene. Camera and objects move exactly as the truth says; cars of the boxes' sizes
// drive on a street that is made along their ways. Depth, flow and masks are exact, so the geometry of a data
// set can be measured without its images.
//
//   replay-vkitti1:DIR#0018[/clone]@124-134   DIR as in vkitti1_truth.h
//   replay-kitti:ROOT#0003@0-30               ROOT/training/{calib,oxts,label_02}, and instances_txt for the
//                                             size of the images where it is there
//
// What is ours: the shapes within the boxes, the street, and that nothing else stands in the way; so masks
// are a little smaller than the boxes, and objects hide one another but nothing else hides them. Pedestrians
// and cyclists move as rigid bodies.

#include <memory>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/kitti_truth.h"
#include "sextant/datasets/rendered_sequence.h"

namespace sextant {

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
