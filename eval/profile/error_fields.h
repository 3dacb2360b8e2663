#pragma once

// Errors of a source's own flow and depth at the pixels of one frame: measured minus reference (px; NaN
// without a reference).
//
//   flow, given             the data set's true flow; for an exact source with noise, its clean flow
//   flow, induced           at background pixels (mask 0) 3 to 40 m away: project(T p z) - p, with the
//                           measured depth z and the motion T that fits the measured flow best
//                           (joint_flow_depth on corners, or on a grid if there is no image; corners, because
//                           the flow that dominates on a smooth road need not be consistent with a motion).
//                           The result contains the error induced by the depth, and lacks the 6 degrees of
//                           freedom of T in each frame
//   disparity, given        bf / z minus bf / z_true
//   disparity, next_frame   at the same background pixels: the disparity read in the next frame at the target
//                           of T, minus that of the point moved by T, divided by sqrt(2) because both have
//                           errors. Errors that are equal in both frames cancel
//   disparity, left_right   the left disparity minus that of SGBM on the right image, read at the pixel
//                           nearest to the target of the left disparity, over sqrt(2); SGBM itself removes
//                           differences above 1 px

#include <optional>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/profile/channel_errors.h"
#include "sextant/noise/noise.h"

namespace sextant {

enum class FlowReference { none, given, induced };
constexpr Names<3> names_of(FlowReference) { return {"none", "given", "induced"}; }
enum class DepthReference { none, given, left_right, next_frame };
constexpr Names<4> names_of(DepthReference) { return {"none", "given", "left_right", "next_frame"}; }

/// Errors of one frame by axis (ChannelField); empty without a reference.
struct ErrorFields {
  std::vector<Image<float>> flow_px, disparity_px;
  std::vector<ChannelField::Property> properties;  ///< measured values at the same pixels
};

/// A source and the noise added to it.
class ErrorSource {
 public:
  /// Chooses the references; `depth` none or given: the best available one, given before next_frame. Throws
  /// Error if neither flow nor depth has a reference, or if left_right is requested for a source without
  /// depth or without the images of both cameras.
  ErrorSource(const Sequence& sequence, Noise noise, uint64_t seed, DepthReference depth);

  FlowReference flow_reference() const { return flow_; }
  DepthReference depth_reference() const { return depth_; }
  /// Returns the errors of a frame; nullopt if it has neither flow nor depth errors.
  std::optional<ErrorFields> read(int frame) const;

 private:
  Frame measured(int frame, Channels channels) const;
  Image<Flow> given_flow(int frame) const;
  Image<float> given_depth(int frame) const;

  const Sequence& sequence_;
  Noise noise_;
  Draws draws_;
  FlowReference flow_ = FlowReference::none;
  DepthReference depth_ = DepthReference::none;
};

}  // namespace sextant
