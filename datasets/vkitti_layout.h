#pragma once

// Both releases of Virtual KITTI: files that their adapters share, and the layouts that write them.
//
// What the adapters of both releases of Virtual KITTI share.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/folder_sequence.h"
#include "sextant/datasets/layout.h"

namespace sextant {

inline constexpr int vkitti_width = 1242;  ///< px, of both releases
inline constexpr int vkitti_height = 375;

/// Without any file, the frames of the truth and the releases' size.
FolderFiles vkitti_files(const SequenceTruth& truth);

/// Throws Error when a chosen frame has no true pose although others have.
void check_vkitti_frames(const Sequence& sequence, const std::string& root);

// ---- names of sequences

struct VkittiName {
  std::string group;      ///< "0018" (1.3.1), "Scene18" (2.0.3)
  std::string variation;  ///< "clone" when not given

  std::string text() const { return group + "/" + variation; }
};

/// "0018/clone" or "0018".
VkittiName parse_vkitti1_name(const std::string& sequence);
/// "Scene18/clone", "0018/clone", "Scene18" or "0018".
VkittiName parse_vkitti2_name(const std::string& sequence);

// What the writers of Virtual KITTI layouts share: the frames' pixels, and the numbers that
// both releases have of an object.

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

// Writers of the layouts of Virtual KITTI (vkitti1.h, vkitti2.h): any Sequence, with all channels that the
// layout has and the sequence gives, and its truth as text. All but the JPEG images of vkitti2 read back as
// what was written, up to the formats' steps: 1 cm of depth, 2 (w-1) / 65535 px of flow.
//
//   - Flow and depth are the truth (true_flow, true_depth) where the sequence tells it from what it reads.
//   - Flow that leaves the image is invalid, as in the data set.
//   - An object's 2-D box: that of the truth, else the extent of its pixels in the mask. An object without
//     either is not in view and left out, as in the data set.
//   - `moving`: that of the truth, else whether its pose in the world changes by more than 1 cm to the next
//     frame (in the last frame: from the one before).
//   - truncation ratio: share of the 3-D box's volume outside of the view (rows of the real worlds differ
//     from that by less than 0.05 in the median); truncated = 1 from above 0, 2 from 0.78.
//   - occupancy ratio: share of the 2-D box that shows the object; occluded = 0 from 0.75, 1 from 0.4, else
//     2. The limits are those between which the data set's own rows lie.
//   - pose.txt and bbox.txt of vkitti2 have rows of camera 0 only: masks are of the left view.
//
// Throw Error when the sequence is there already, on true poses that are missing in some frames, on objects
// without a size, and (vkitti1, which has no file for it) on any camera but f = 725, c = (620.5, 187),
// 1242x375.

/// Sequence "0018/clone"; empty: the number in the sequence's name, clone.
std::string write_vkitti1_layout(const Sequence& sequence, const LayoutRequest& request);
/// Sequence "Scene18/clone"; empty as above.
std::string write_vkitti2_layout(const Sequence& sequence, const LayoutRequest& request);

}  // namespace sextant
