#pragma once

// A scenario from true motions: cars in the place of the labelled boxes, on a street along their ways.

#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/truth/truth.h"

namespace sextant::synthetic {

/// Frames first..last of `truth` become frames 0..last - first. World axes are moved (not turned) so that the
/// first camera is near the origin; y must point down within 30 degrees. Objects without a size get that of
/// a usual one of their type. `shape` gives name, camera, image size and rate. Throws Error when a frame has
/// no camera pose.
Scenario replay_scenario(const SequenceTruth& truth, int first, int last, Scenario shape);

}  // namespace sextant::synthetic
