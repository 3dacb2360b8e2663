#pragma once

// Both releases of Virtual KITTI: what their adapters share, and the layouts that write them.

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

/// Returns a declaration to which the adapters add their files. It determines sequences without any file:
/// their frames are those with a camera pose, or with an object if there are no poses, and their images have
/// the size of the releases.
FolderFiles vkitti_files(const SequenceTruth& truth);

/// Throws Error if a chosen frame has no true pose although other frames have one.
void check_vkitti_frames(const Sequence& sequence, const std::string& root);

// ---- names of sequences

struct VkittiName {
  std::string group;      ///< such as "0018" (1.3.1), "Scene18" (2.0.3)
  std::string variation;  ///< "clone" if not given

  std::string text() const { return group + "/" + variation; }
};

/// Parses "0018/clone" or "0018".
VkittiName parse_vkitti1_name(const std::string& sequence);
/// Parses "Scene18/clone", "0018/clone", "Scene18" or "0018".
VkittiName parse_vkitti2_name(const std::string& sequence);

// Common part of the writers of both layouts: the pixels of the frames, and the object attributes that both
// releases have.

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
  std::string type;  ///< "Car" if the truth has no type
};

/// Returns the value of the column `moving`: true if the position in the world changes by moving_step_m or
/// more to the next frame (from the previous frame, if the object has no pose in the next one). nullopt if
/// the poses do not determine it.
std::optional<bool> moves(const SequenceTruth& truth, int id, int frame);

/// Returns the share of the 3-D box's volume outside the field of view, from 8 x 8 x 8 sample points;
/// requires size_m.
double box_truncation(const SequenceInfo& info, const ObjectTruth& object);

/// Returns one row for each true object in each frame that has a mask or a 2-D box, ordered by frame and id.
/// `outlines` are given by frame. Throws Error if such an object has no size, or blanks in its type.
std::vector<VkittiRow> vkitti_rows(const Sequence& sequence, const std::map<int, MaskOutlines>& outlines);

/// Writes all frames; returns the outlines of their masks by frame.
std::map<int, MaskOutlines> write_vkitti_frames(const Sequence& sequence, const LayoutRequest& request,
                                                std::vector<LayoutFolder> folders);

/// Throws Error if some frames have a true camera pose and others have none, or if there are true objects but
/// no camera poses.
void check_vkitti_poses(const Sequence& sequence);

// Writers of both layouts (vkitti1.h, vkitti2.h): any Sequence, with all channels that both the layout and
// the sequence have, and its truth as text. Everything except the JPEG images of vkitti2 reads back as
// written, up to the quantisation of the formats: 1 cm of depth, 2 (w-1) / 65535 px of flow.
//
//   - Flow and depth are the ground truth (true_flow, true_depth) if the sequence has it, otherwise those of
//     read().
//   - Flow that leaves the image is invalid, as in the data set.
//   - The 2-D box of an object is that of the truth, otherwise the bounding box of its mask. An object
//     without either is not visible and is left out, as in the data set.
//   - `moving` is that of the truth, otherwise that of moves(); false if the poses do not determine it.
//   - truncation ratio: share of the 3-D box's volume outside the field of view (rows of the real worlds
//     differ from that by less than 0.05 in the median); truncated = 1 above 0, 2 from 0.78.
//   - occupancy ratio: share of the 2-D box that shows the object; occluded = 0 from 0.75, 1 from 0.4, else
//     2. These thresholds separate the data set's own rows.
//   - pose.txt and bbox.txt of vkitti2 have rows of camera 0 only: masks are of the left view.
//
// Throw Error if the sequence exists already, like check_vkitti_poses() and vkitti_rows(), and (vkitti1,
// which has no file for it) for any camera except f = 725, c = (620.5, 187), 1242x375.

/// Writes the sequence "0018/clone"; if the name is empty, the number in the sequence's name, and clone.
std::string write_vkitti1_layout(const Sequence& sequence, const LayoutRequest& request);
/// Writes the sequence "Scene18/clone"; an empty name as above.
std::string write_vkitti2_layout(const Sequence& sequence, const LayoutRequest& request);

}  // namespace sextant
