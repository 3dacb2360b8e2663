#pragma once

// Object truth by frame number, as label files of every data set give it.

#include <map>
#include <vector>

#include "sextant/datasets/channels/channel_source.h"
#include "sextant/truth/truth.h"

namespace sextant {

using ObjectTruths = std::map<int, std::vector<ObjectTruth>>;

/// Sets `interpolated` where an object's position steps from and to its neighbour frames are equal:
/// |p(k+1) - 2 p(k) + p(k-1)| <= 1e-6 max(1, |p(k)|), which annotators' linear interpolation gives and real
/// motion does not.
void mark_interpolated(ObjectTruths& objects);

/// The 2-D boxes of all objects that have one, for masks of boxes.
std::map<int, std::vector<LabelBox>> label_boxes(const ObjectTruths& objects);

}  // namespace sextant
