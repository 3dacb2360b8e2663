#pragma once

// What the writers of Virtual KITTI layouts share (vkitti_layout.h): the frames' pixels, and the numbers that
// both releases have of an object.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/codec/vkitti_box.h"
#include "sextant/datasets/layout.h"

namespace sextant {

using MaskOutlines = std::map<int, MaskOutline>;

/// One object in one frame.
struct VkittiRow {
  int frame = 0;
  int track = 0;  ///< id - 1
  const ObjectTruth* object = nullptr;
  VkittiAngles angles;
  double alpha_rad = 0;
  ImageBox box;
  int n_pixels = 0;
  double truncation = 0;
  double occupancy = 0;
  bool moving = false;
  std::string type;  ///< "Car" when the truth has none
};

/// What the column `moving` says: a step of moving_step_m or more to the next frame, in the last from the one
/// before. None where the poses do not tell.
std::optional<bool> moves(const SequenceTruth& truth, int id, int frame);

/// Share of the 3-D box's volume outside of the view, on 8 x 8 x 8 points of it; needs size_m.
double box_truncation(const SequenceInfo& info, const ObjectTruth& object);

/// In order of frame and id. `outlines` by frame.
std::vector<VkittiRow> vkitti_rows(const Sequence& sequence, const std::map<int, MaskOutlines>& outlines);

/// Writes all frames; returns the outlines of their masks.
std::map<int, MaskOutlines> write_vkitti_frames(const Sequence& sequence, const LayoutRequest& request,
                                                std::vector<LayoutFolder> folders);

/// Throws Error unless all frames have a true camera pose, or none.
void check_vkitti_poses(const Sequence& sequence);

}  // namespace sextant
