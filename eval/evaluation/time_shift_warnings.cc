#include "sextant/eval/evaluation/time_shift_warnings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/eval/evaluation/trajectory_matching.h"

namespace sextant {
namespace {

/// Warns if the motions determine a shift of the estimate's clock by more than half a time step, although
/// they agree well without it.
std::optional<TrajectoryWarning> warning_of_offset(PoseSeries reference, PoseSeries estimate,
                                                   const std::vector<double>& reference_times,
                                                   const std::vector<double>& estimate_times, bool seconds,
                                                   double offset_s, const OffsetRemedy& remedy) {
  reference.stamps_s = reference_times;
  estimate.stamps_s = estimate_times;
  if (reference.size() < 2 || estimate.size() < 2) return std::nullopt;
  const double half_step = std::max(median_step(reference_times), median_step(estimate_times)) / 2;
  try {
    const OffsetEstimate found = estimate_offset(reference, estimate, 0, "");
    if (found.low_s <= half_step && found.high_s >= -half_step) return std::nullopt;
    return TrajectoryWarning{
        "lag", fmt::format("the estimate's motion is {} by {:.3g} {} (95 % interval {:.3g} to {:.3g}){}",
                           found.offset_s < 0 ? "late" : "early", std::abs(found.offset_s),
                           seconds ? "s" : "frames", std::min(std::abs(found.low_s), std::abs(found.high_s)),
                           std::max(std::abs(found.low_s), std::abs(found.high_s)),
                           seconds ? "; try " + remedy(offset_s + found.offset_s)
                                   : fmt::format(": add {:.0f} to its frame numbers", found.offset_s))};
  } catch (const Error&) {  // the motions do not determine the offset
    return std::nullopt;
  }
}

/// Returns the mean squared distance after `shift_s` is added to the estimate's stamps; empty if fewer than
/// 10 poses match, or cannot be aligned.
std::optional<double> shifted_squares(const PoseSeries& reference, const PoseSeries& estimate, double shift_s,
                                      const AlignmentChoice& choice) {
  std::vector<double> times;
  for (const double t : estimate.stamps_s) times.push_back(t + shift_s);
  const double max_gap_s = 2 * std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s));
  const InterpolatedPoses at = interpolate_poses(reference, times, max_gap_s);
  if (at.asked.size() < fewest_explained_poses) return std::nullopt;
  PoseSeries matched = estimate;
  matched.keep(at.asked);
  const auto found = aligned_agreement(at.poses, std::move(matched), choice);
  if (!found) return std::nullopt;
  return found->mean_squares_m2();
}

/// Returns the mean squared difference of the steps, m^2: of the lengths of their translations, and of their
/// rotations in rad times a typical lever of 10 m.
double step_squares(const PoseSeries& reference, const PoseSeries& estimate, size_t shift_r, size_t shift_e,
                    size_t n) {
  constexpr double lever_m = 10;
  double sum = 0;
  for (size_t i = 1; i < n; ++i) {
    const RelativePose r = relative_pose(reference, shift_r + i - 1, shift_r + i);
    const RelativePose e = relative_pose(estimate, shift_e + i - 1, shift_e + i);
    const double angle =
        rotation_angle_rad(Eigen::Quaterniond(Eigen::Matrix3d(r.rotation.transpose() * e.rotation)));
    const double length = r.translation_m.norm() - e.translation_m.norm();
    sum += length * length + lever_m * lever_m * angle * angle;
  }
  return sum / static_cast<double>(n - 1);
}

/// Least sum of squared distances that another place of the world or of the body on its carrier leaves.
double squares_of_place(const PoseSeries& reference, const PoseSeries& estimate, AlignmentChoice choice) {
  if (!turns_world(choice.alignment)) choice.alignment = Alignment::se3;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const PoseSeries& at) {
    if (const auto found = aligned_agreement(reference, at, choice)) least = std::min(least, found->squares);
  };
  consider(estimate);
  if (const auto lever_m = estimate_lever_arm(reference, estimate))
    consider(at_lever_arm(estimate, *lever_m));
  return least;
}

}  // namespace

std::optional<TrajectoryWarning> warning_of_lag(const PoseSeries& reference, const PoseSeries& estimate,
                                                double offset_s, const OffsetRemedy& remedy) {
  const bool seconds = !reference.stamps_s.empty() && !estimate.stamps_s.empty();
  std::vector<double> a, b;
  if (seconds) {
    a = reference.stamps_s;
    for (const double t : estimate.stamps_s) b.push_back(t + offset_s);
  } else {
    const std::vector<int> fa = frames_of(reference), fb = frames_of(estimate);
    a.assign(fa.begin(), fa.end());
    b.assign(fb.begin(), fb.end());
  }
  const auto lag = estimate_lag(reference, a, estimate, b);
  constexpr size_t most_poses = 20'000;  // longer recordings are examined by estimate_lag() alone
  if (!lag) {
    if (std::max(a.size(), b.size()) > most_poses) return std::nullopt;
    return warning_of_offset(reference, estimate, a, b, seconds, offset_s, remedy);
  }
  const std::string advice = seconds ? "; try " + remedy(offset_s - lag->lag) : "";
  return TrajectoryWarning{
      "lag",
      fmt::format("the estimate's motion is {} by about {:.3g} {}: motions correlate at {:.3f} with this "
                  "shift, {:.3f} without{}",
                  lag->lag > 0 ? "late" : "early", std::abs(lag->lag), seconds ? "s" : "frames",
                  lag->correlation, lag->correlation_0, advice)};
}

std::optional<TrajectoryWarning> warning_of_clock(const PoseSeries& reference, const PoseSeries& estimate,
                                                  double offset_s, const AlignmentChoice& choice,
                                                  const OffsetRemedy& remedy) {
  if (reference.stamps_s.empty() || estimate.stamps_s.empty() || reference.size() < fewest_explained_poses ||
      estimate.size() < fewest_explained_poses)
    return std::nullopt;
  AlignmentChoice all = choice;
  all.n_to_align = 0;
  const double step = std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s));
  const PoseSeries some = thinned(estimate);
  const auto squares = [&](double shift_s) {
    return shifted_squares(reference, some, offset_s + shift_s, all);
  };
  const auto before = squares(-step), now = squares(0), after = squares(step);
  if (!before || !now || !after) return std::nullopt;
  const double bend = *before - 2 * *now + *after;
  if (!(bend > 0)) return std::nullopt;
  const auto explains = [&](std::optional<double> then) {
    return then && *then <= largest_left_share * *now;
  };
  if (!explains(squares(std::clamp(0.5 * step * (*before - *after) / bend, -step, step))))
    return std::nullopt;
  try {  // a shift along a straight path may be drift, so the motions alone must confirm it
    const OffsetEstimate found = estimate_offset(reference, estimate, offset_s, "");
    const bool is_zero = found.low_s <= offset_s && offset_s <= found.high_s;
    const double shift_s = found.offset_s - offset_s;
    const auto then = squares(shift_s);
    if (is_zero || !explains(then)) return std::nullopt;
    return TrajectoryWarning{
        "lag", fmt::format("the estimate's clock is {} by {:.3g} s, which explains {:.0f} % of the squared "
                           "errors; try {}",
                           shift_s < 0 ? "late" : "early", std::abs(shift_s), 100 * (1 - *then / *now),
                           remedy(found.offset_s))};
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<TrajectoryWarning> warning_of_rows(const PoseSeries& reference, const PoseSeries& estimate,
                                                 double offset_s, const AlignmentChoice& choice,
                                                 const OffsetRemedy& remedy) {
  constexpr int most_rows = 3;
  constexpr size_t least_poses = 20;
  constexpr double confirmed = 1.5;
  const bool stamped = !reference.stamps_s.empty() && !estimate.stamps_s.empty();
  const std::vector<int> frames = frames_of(reference);
  for (size_t i = 1; !stamped && i < frames.size(); ++i) {
    if (frames[i] != frames[i - 1] + 1) return std::nullopt;
  }
  if (!reference.has_rotations() || !estimate.has_rotations() || estimate.size() < least_poses)
    return std::nullopt;
  const double step_s = stamped ? median_step(reference.stamps_s) : 0;
  const auto correction = [&](int n_frames) {  // to add to the estimate's
    return stamped
               ? "give " + remedy(offset_s + n_frames * step_s)
               : fmt::format("add {} to its frame numbers (a frame number may stand before the 12 values)",
                             n_frames);
  };
  AlignmentChoice all = choice;
  all.n_to_align = 0;
  const size_t n = estimate.size() - most_rows;
  const auto shifted = [&](int k) {  // row i + k of the estimate belongs to row i
    const size_t of_reference = k < 0 ? static_cast<size_t>(-k) : 0,
                 of_estimate = k > 0 ? static_cast<size_t>(k) : 0;
    const double steps = step_squares(reference, estimate, of_reference, of_estimate, n);
    const auto found =
        aligned_agreement(thinned(reference, of_reference, n), thinned(estimate, of_estimate, n), all);
    return std::pair(found ? std::optional(found->squares) : std::nullopt, steps);
  };
  const auto [squares_0, steps_0] = shifted(0);
  constexpr double of_path = 25;
  const double by_place = squares_of_place(reference, estimate, all);
  std::vector<Reading> readings;
  for (int k = -most_rows; k <= most_rows; ++k) {
    if (k == 0) continue;
    const auto [squares, steps] = shifted(k);
    const std::string cause = fmt::format("the estimate is {} by {} frame{}", k > 0 ? "late" : "early",
                                          std::abs(k), std::abs(k) > 1 ? "s" : "");
    const bool by_path =
        squares && squares_0 && explains_times * *squares <= *squares_0 && confirmed * steps <= steps_0;
    const bool by_steps =
        explains_times * steps <= steps_0 && (!squares || !squares_0 || *squares <= 1.01 * *squares_0);
    // Where independent errors of the poses hide the steps, the path decides, if no other place of the world
    // or of the body explains it.
    const bool by_path_alone =
        squares && squares_0 && of_path * *squares <= *squares_0 && explains_times * *squares <= by_place;
    if (by_path || by_steps || by_path_alone) readings.push_back({"lag", cause, correction(-k), steps, 0});
  }
  const auto best = std::ranges::min_element(readings, {}, &Reading::residual);
  if (best == readings.end() || !(steps_0 > 1e-12)) return std::nullopt;
  return TrajectoryWarning{
      "lag", fmt::format("{}: {} (RMS difference of the steps {:.3g} m read so, {:.3g} m as declared)",
                         best->cause, best->remedy, std::sqrt(best->residual), std::sqrt(steps_0))};
}

}  // namespace sextant
