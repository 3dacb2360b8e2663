#pragma once

// Detects a shift of frame numbers when errors are too large for the rule of hypothesis.h.
//
// With b_k the reference step of frame k in the body frame and g_k the given one, the error of a step is
// e_k = log(inverse(b_k) g_k). Where the motion of frame k stands at frame k + n, g_k is b_{k-n} up to noise,
// and
//
//   e_k = a d_k + noise,   d_k = log(inverse(b_k) b_{k-n}),   with a = 1; right frame numbers have a = 0
//
// The share a is fitted over the steps of all bodies at once, robustly (Huber), each of six components
// (translation, rotation) of each body weighed by its own scatter. Its standard error is a jackknife over
// stretches of frames, as errors of neighbouring frames depend on each other: ten stretches, or fewer of two
// frames each if there are less than 20 frames. Independent noise of the reference from frame to frame is in
// both e and d, and pulls a to 1/2. A shift is reported where a is within 0.3 of 1 and above 1/2 by five
// standard errors; with fewer stretches by the quantile of Student's t at the same probability (14 with
// four). Steps whose changes over the shift are small against their noise, or against that of the
// reference, do not determine a: nothing is reported, whatever the frame numbers are.
//
// Errors of another cause, such as exchanged objects, have a large constant part, which may resemble a
// change. No shift is reported where a constant error of each body explains the errors much better than the
// shift.

#include <array>
#include <map>
#include <optional>
#include <vector>

#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/geometry/se3.h"

namespace sextant {

inline constexpr int longest_shift = 3;

/// Translation and rotation of a step, m and rad.
Vector6d step_numbers(const SE3& error);

struct StepError {
  int body = 0, frame = 0;
  Vector6d error;                    ///< e_k
  std::map<int, Vector6d> of_shift;  ///< d_k by n in -3 .. 3, where the reference of frame k - n is known
};

/// A shift that was found: the fitted share a with its standard error.
struct FrameShift {
  int frames = 0;
  double share = 0, standard_error = 0;
  /// Mean change of the cost of a step if this shift is applied; the most negative value fits best.
  double cost_change = 0;

  /// `read` is the reading of the data with this shift; the share a is added to its text.
  Explanation explanation(Reading read, double declared) const;
};

/// Needs steps in 8 different frames, and 8 steps of a body; empty if no shift meets the conditions above.
std::optional<FrameShift> find_frame_shift(const std::vector<StepError>& steps);

}  // namespace sextant
