#pragma once

// Detection of a shift of frame numbers when errors are too large for the rule of hypothesis.h.
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
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/geometry/se3.h"

namespace sextant {

/// The shifts n that are tried, in frames.
inline constexpr std::array frame_shifts = {-3, -2, -1, 1, 2, 3};
/// Price of a shift of the frame numbers: it is reported only if no other single mistake explains the data as
/// well.
inline constexpr double price_of_lag = 0.2;
/// Factor on the times by which a shift must explain the data better, since six shifts of a smooth motion are
/// tried.
inline constexpr double strictness_of_lag = 2;

/// Returns the hypothesis that the value of frame k stands at frame k + lag. `undo` applies it to the data;
/// `value` names the value in the text: "the pose of frame k".
template <typename Data, typename Undo>
Hypothesis<Data> shift_hypothesis(std::string code, const std::string& value, int lag, Undo undo,
                                  double price = price_of_lag) {
  return {std::move(code),
          fmt::format("the frame numbers look shifted: {} stands at frame k{:+d}", value, lag),
          fmt::format("{} {} {} each frame number", lag > 0 ? "subtract" : "add", std::abs(lag),
                      lag > 0 ? "from" : "to"),
          std::move(undo),
          price,
          false,
          strictness_of_lag};
}

/// Translation and rotation of a step, m and rad.
Vector6d step_numbers(const SE3& error);

struct StepError {
  int body = 0, frame = 0;
  Vector6d error;                    ///< e_k
  std::map<int, Vector6d> of_shift;  ///< d_k by n, where the reference of frame k - n is known
};

/// A shift that was found: the fitted share a with its standard error.
struct FrameShift {
  int frames = 0;
  double share = 0, standard_error = 0;
  /// Mean change of the cost of a step if this shift is applied; the most negative value fits best.
  double cost_change = 0;

  /// Formats the share a, to be added to the cause of a reading.
  std::string text() const;
};

/// Needs steps in 8 different frames, and 8 steps of a body; empty if no shift meets the conditions above.
std::optional<FrameShift> find_frame_shift(const std::vector<StepError>& steps);

/// Explains data by a shift that was found, whose hypothesis has the code `code` in the table; nullopt if it
/// makes the errors larger.
template <typename Data, typename Residual>
std::optional<Explanation> explain_by_shift(const FrameShift& found, const std::string& code,
                                            std::vector<Hypothesis<Data>> table, const Data& data,
                                            const Residual& residual) {
  const std::optional<double> declared = residual(data);
  std::erase_if(table, [&](const auto& hypothesis) { return hypothesis.code != code; });
  std::vector<Reading> read = read_as(table, data, residual);
  if (!declared || read.empty() || read.front().residual > *declared) return std::nullopt;
  read.front().cause += found.text();
  return Explanation{std::move(read.front()), {}, *declared};
}

}  // namespace sextant
