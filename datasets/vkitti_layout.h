#pragma once

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

#include <string>

#include "sextant/datasets/layout.h"

namespace sextant {

/// Sequence "0018/clone"; empty: the number in the sequence's name, clone.
std::string write_vkitti1_layout(const Sequence& sequence, const LayoutRequest& request);
/// Sequence "Scene18/clone"; empty as above.
std::string write_vkitti2_layout(const Sequence& sequence, const LayoutRequest& request);

}  // namespace sextant
