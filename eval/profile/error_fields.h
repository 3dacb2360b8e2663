#pragma once

// The errors of a source's own flow and depth at the pixels of one frame: measured less reference.
//
//   flow, given      the data set's true flow; of an exact source with noise, its clean flow
//   flow, induced    at pixels of the background (mask 0) 3 to 40 m away: project(T p z) - p, with the
//                    measured
//                    depth z and the motion T that fits the measured flow best (joint_flow_depth on corners,
//                    without an image on a grid: what most of the flow on a smooth road agrees on need not be
//                    a motion). So it holds what the depth's own error induces, and lacks 6 numbers a frame
//   disparity, given bf / z less bf / z_true
//   disparity, next_frame  at the same background pixels: the disparity read in the next frame where T leads,
//                    less that of the point moved by T, divided by sqrt(2) because both err. What errs alike
//                    in both frames does not show
//   disparity, left_right  SGBM of the right image read where the left disparity leads, less that, over
//                          sqrt(2);
//                    beyond 1 px SGBM itself has thrown away
//
// px; NaN where there is no reference.

#include <optional>

#include "sextant/base/names.h"
#include "sextant/datasets/dataset.h"
#include "sextant/noise/noise.h"

namespace sextant {

enum class FlowReference { none, given, induced };
constexpr Names<3> names_of(FlowReference) { return {"none", "given", "induced"}; }
enum class DepthReference { none, given, left_right, next_frame };
constexpr Names<4> names_of(DepthReference) { return {"none", "given", "left_right", "next_frame"}; }

struct ErrorFields {
  int frame = 0;
  Image<Flow> flow_px;
  Image<float> disparity_px;
  // Of the same pixels, as measured:
  Image<float> flow_length_px;
  Image<float> depth_m;
  Image<uint16_t> mask;  ///< empty: the source has none
};

/// A source and what is added to it.
class ErrorSource {
 public:
  /// Chooses references; `depth` none: as available, given before next_frame. Throws Error when neither flow
  /// nor depth has one, or when left_right is asked of a source without two images.
  ErrorSource(const Sequence& sequence, Noise noise, uint64_t seed, DepthReference depth);

  FlowReference flow_reference() const { return flow_; }
  DepthReference depth_reference() const { return depth_; }
  /// Empty where a frame has neither.
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
