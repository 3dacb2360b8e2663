#include "sextant/eval/evaluation/time_shift_warnings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/eval/evaluation/body_offset.h"
#include "sextant/eval/evaluation/trajectory_matching.h"

namespace sextant {
namespace {

/// Matches the poses after `shift_s` is added to the estimate's stamps; empty if fewer than 10 match.
std::optional<TrajectoryPair> shifted(const PoseSeries& reference, const PoseSeries& estimate,
                                      double shift_s) {
  std::vector<double> times;
  for (const double t : estimate.stamps_s) times.push_back(t + shift_s);
  const double max_gap_s = 2 * std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s));
  InterpolatedPoses at = interpolate_poses(reference, times, max_gap_s);
  if (at.asked.size() < fewest_explained_poses) return std::nullopt;
  TrajectoryPair matched{std::move(at.poses), estimate};
  matched.estimate.keep(at.asked);
  return matched;
}

/// Returns the mean squared distance of a matched pair; empty if it is empty or cannot be aligned.
std::optional<double> squares_of(const std::optional<TrajectoryPair>& matched,
                                 const AlignmentChoice& choice) {
  const auto found = matched ? aligned_agreement(*matched, choice) : std::nullopt;
  return found ? std::optional(found->mean_squares_m2()) : std::nullopt;
}

/// Returns the mean squared difference of the steps of `n` poses from the given ones on, m^2: of the lengths
/// of their translations, and of their rotations in rad times a typical lever of 10 m.
double step_squares(const TrajectoryPair& pair, size_t first_r, size_t first_e, size_t n) {
  constexpr double lever_m = 10;
  double sum = 0;
  for (size_t i = 1; i < n; ++i) {
    const RelativePose r = relative_pose(pair.reference, first_r + i - 1, first_r + i);
    const RelativePose e = relative_pose(pair.estimate, first_e + i - 1, first_e + i);
    const double angle = rotation_angle_rad(r.rotation.transpose() * e.rotation);
    const double length = r.translation_m.norm() - e.translation_m.norm();
    sum += length * length + lever_m * lever_m * angle * angle;
  }
  return sum / static_cast<double>(n - 1);
}

/// Longer recordings are not copied for the checks of a pair with times.
bool is_short(const PoseSeries& reference, const PoseSeries& estimate) {
  constexpr size_t most_poses = 1'000'000;
  return std::max(reference.size(), estimate.size()) <= most_poses;
}

/// Returns the series with its frame numbers as times.
PoseSeries timed_by_frames(PoseSeries series) {
  const std::vector<int> frames = frames_of(series);
  series.stamps_s.assign(frames.begin(), frames.end());
  return series;
}

/// Returns true if both series have time stamps; if not, frame numbers take their place.
bool have_stamps(const PoseSeries& reference, const PoseSeries& estimate) {
  return !reference.stamps_s.empty() && !estimate.stamps_s.empty();
}

/// Returns both trajectories with the times at which they are compared, the estimate thinned. They are not
/// matched.
TrajectoryPair timed_pair(const PoseSeries& reference, const PoseSeries& estimate, double offset_s) {
  if (!have_stamps(reference, estimate))
    return {timed_by_frames(reference), thinned(timed_by_frames(estimate))};
  TrajectoryPair pair{reference, thinned(estimate)};
  for (double& t : pair.estimate.stamps_s) t += offset_s;
  return pair;
}

/// Root mean squared distances, m, without a shift and with it.
struct ShiftedErrors {
  double now_m = 0, then_m = 0;
};

/// Returns the errors if a shift explains neither the positions, of which at most half the RMSE may be left
/// after the chosen alignment or one with scale, nor half of the squared differences of the steps. A shift of
/// more than ten steps, at which a path is compared with another part of the reference, must explain both.
/// Empty if it does, or if too few poses match without the shift.
std::optional<ShiftedErrors> unexplained_by(const TrajectoryPair& timed, double shift,
                                            const AlignmentChoice& choice) {
  constexpr double largest_rmse_share = 0.5, far_steps = 10;
  const auto before = shifted(timed.reference, timed.estimate, 0),
             after = shifted(timed.reference, timed.estimate, shift);
  const AlignmentChoice of_all = choice.with(choice.alignment), with_scale = choice.with(Alignment::sim3);
  const auto now = squares_of(before, of_all), then = squares_of(after, of_all);
  if (!now || !then) return std::nullopt;
  const auto scaled_now = squares_of(before, with_scale), scaled_then = squares_of(after, with_scale);
  constexpr double largest_share = largest_rmse_share * largest_rmse_share;
  const bool explains_positions = *then <= largest_share * *now ||
                                  (scaled_now && scaled_then && *scaled_then <= largest_share * *scaled_now);
  const auto steps = [](const TrajectoryPair& m) { return step_squares(m, 0, 0, m.size()); };
  const bool rotations = timed.has_rotations();
  const bool explains_steps = rotations && steps(*after) <= largest_left_share * steps(*before);
  const bool is_far = std::abs(shift) > far_steps * median_step(timed.reference.stamps_s);
  const bool explains =
      is_far && rotations ? explains_positions && explains_steps : explains_positions || explains_steps;
  return explains ? std::nullopt : std::optional(ShiftedErrors{std::sqrt(*now), std::sqrt(*then)});
}

/// Least sum of squared distances that another place of the world or of the body on its carrier leaves.
double squares_of_place(const TrajectoryPair& pair, const AlignmentChoice& choice) {
  const AlignmentChoice turned = choice.with(choice.turns_world() ? choice.alignment : Alignment::se3);
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const TrajectoryPair& at) {
    if (const auto found = aligned_agreement(at, turned)) least = std::min(least, found->squares);
  };
  consider(pair);
  if (const auto lever_m = estimate_lever_arm(pair)) consider(at_lever_arm(thinned(pair), *lever_m));
  return least;
}

/// Returns the offset that the motions determine, relative to `offset_s`, if its interval lies outside half a
/// time step. It counts frames if a recording has no stamps.
std::optional<OffsetEstimate> shift_of_motions(const PoseSeries& reference, const PoseSeries& estimate,
                                               double offset_s) {
  if (reference.size() < 2 || estimate.size() < 2) return std::nullopt;
  if (!have_stamps(reference, estimate))
    return shift_of_motions(timed_by_frames(reference), timed_by_frames(estimate), 0);
  OffsetEstimate found;
  try {
    found = estimate_offset(reference, estimate, offset_s, "");
  } catch (const Error&) {  // the motions do not determine the offset
    return std::nullopt;
  }
  for (double* const time : {&found.offset_s, &found.low_s, &found.high_s}) *time -= offset_s;
  const double half_step = std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s)) / 2;
  return found.low_s > half_step || found.high_s < -half_step ? std::optional(found) : std::nullopt;
}

}  // namespace

std::optional<DataWarning> warning_of_lag(const PoseSeries& reference, const PoseSeries& estimate,
                                          double offset_s, const AlignmentChoice& choice,
                                          const OffsetRemedy& remedy) {
  const auto found = shift_of_motions(reference, estimate, offset_s);
  if (!found) return std::nullopt;
  const double shift = found->offset_s;
  const bool seconds = have_stamps(reference, estimate);
  const char* const unit = seconds ? "s" : "frames";
  const auto left = is_short(reference, estimate)
                        ? unexplained_by(timed_pair(reference, estimate, offset_s), shift, choice)
                        : std::nullopt;
  if (left) {
    // The motions of a good estimate may agree with a shift by chance.
    constexpr double good_share = 0.05;
    if (left->then_m >= left->now_m || left->now_m <= good_share * rms_extent_m(reference))
      return std::nullopt;
    return DataWarning{
        "no_offset",
        fmt::format("no offset explains the errors: the motions agree best when the estimate is shifted by "
                    "{:.3g} {}, which leaves a position RMSE of {:.3g} m of {:.3g} m: is it of another "
                    "recording, or does its clock run at another rate?",
                    shift, unit, left->then_m, left->now_m)};
  }
  const auto [shortest, longest] = std::minmax({std::abs(found->low_s), std::abs(found->high_s)});
  return DataWarning{
      "lag", fmt::format("the estimate's motion is {} by {:.3g} {} (95 % interval {:.3g} to {:.3g}){}",
                         shift < 0 ? "late" : "early", std::abs(shift), unit, shortest, longest,
                         seconds ? "; try " + remedy(offset_s + shift)
                                 : fmt::format(": add {:.0f} to its frame numbers", shift))};
}

std::optional<DataWarning> warning_of_clock_rate(const PoseSeries& reference, const PoseSeries& estimate,
                                                 double offset_s, const AlignmentChoice& choice) {
  constexpr double least_change = 0.002;
  if (std::min(reference.size(), estimate.size()) < fewest_explained_poses || !is_short(reference, estimate))
    return std::nullopt;
  const TrajectoryPair pair = timed_pair(reference, estimate, offset_s);
  const std::vector<double>&a = pair.reference.stamps_s, &b = pair.estimate.stamps_s;
  const double factor = (a.back() - a.front()) / (b.back() - b.front());
  if (!(factor > 0 && std::isfinite(factor))) return std::nullopt;
  const AlignmentChoice of_all = choice.with(choice.alignment);
  const auto matched = shifted(pair.reference, pair.estimate, 0);
  const auto now = squares_of(matched, of_all), scaled = squares_of(matched, choice.with(Alignment::sim3));
  if (!now || !scaled) return std::nullopt;
  const auto explained = [&](const PoseSeries& read) {
    const auto then = squares_of(shifted(pair.reference, read, 0), of_all);
    const bool explains = then && explains_times * *then + negligible_residual <= std::min(*now, *scaled);
    return explains ? then : std::nullopt;
  };
  const auto rmse = [&](double then) {
    return fmt::format(" (position RMSE {:.3g} m read so, {:.3g} m as declared)", std::sqrt(then),
                       std::sqrt(*now));
  };
  const bool by_time = have_stamps(reference, estimate);
  const char* const times = by_time ? "time stamps" : "frame numbers";
  PoseSeries read = pair.estimate;
  for (double& t : read.stamps_s) t = a.front() + factor * (t - b.front());
  if (std::abs(factor - 1) > least_change) {
    if (const auto then = explained(read)) {
      return DataWarning{
          "clock_rate",
          fmt::format("the estimate's {0} advance at {1:.5g} times the rate of the reference's: "
                      "replace each t by {2:.10g} + {3:.6g} (t - {4:.10g}){5}",
                      times, 1 / factor, a.front(), factor, b.front() - (by_time ? offset_s : 0),
                      rmse(*then))};
    }
  }
  std::vector<int> rows(read.size());
  for (size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<int>(rows.size() - 1 - i);
  read = pair.estimate;
  read.keep(rows);
  for (size_t i = 0; i < rows.size(); ++i)
    read.stamps_s[i] = b.front() + (b.back() - b[static_cast<size_t>(rows[i])]);
  if (const auto then = explained(read)) {
    return DataWarning{"reversed", fmt::format("the estimate is reversed in time: write its poses in the "
                                               "opposite order, with the {} ascending{}",
                                               times, rmse(*then))};
  }
  return std::nullopt;
}

std::optional<DataWarning> warning_of_clock(const PoseSeries& reference, const PoseSeries& estimate,
                                            double offset_s, const AlignmentChoice& choice,
                                            const OffsetRemedy& remedy) {
  if (!have_stamps(reference, estimate) || reference.size() < fewest_explained_poses ||
      estimate.size() < fewest_explained_poses)
    return std::nullopt;
  const double step = std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s));
  const auto squares = [&, some = thinned(estimate)](double shift_s) {
    return squares_of(shifted(reference, some, offset_s + shift_s), choice.with(choice.alignment));
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
    return DataWarning{
        "lag", fmt::format("the estimate's clock is {} by {:.3g} s, which explains {:.0f} % of the squared "
                           "errors; try {}",
                           shift_s < 0 ? "late" : "early", std::abs(shift_s), 100 * (1 - *then / *now),
                           remedy(found.offset_s))};
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<DataWarning> warning_of_rows(const TrajectoryPair& pair, double offset_s,
                                           const AlignmentChoice& choice, const OffsetRemedy& remedy) {
  constexpr int most_rows = 3;
  constexpr size_t least_poses = 20;
  constexpr double confirmed = 1.5;
  const auto& [reference, estimate] = pair;
  const bool stamped = have_stamps(reference, estimate);
  const std::vector<int> frames = frames_of(reference);
  for (size_t i = 1; !stamped && i < frames.size(); ++i) {
    if (frames[i] != frames[i - 1] + 1) return std::nullopt;
  }
  if (!pair.has_rotations() || pair.size() < least_poses) return std::nullopt;
  const double step_s = stamped ? median_step(reference.stamps_s) : 0;
  const auto correction = [&](int n_frames) {  // to add to the estimate's
    return stamped
               ? "give " + remedy(offset_s + n_frames * step_s)
               : fmt::format("add {} to its frame numbers (a frame number may stand before the 12 values)",
                             n_frames);
  };
  const AlignmentChoice all = choice.with(choice.alignment);
  const size_t n = pair.size() - most_rows;
  const auto shifted = [&](int k) {  // row i + k of the estimate belongs to row i
    const size_t of_reference = k < 0 ? static_cast<size_t>(-k) : 0,
                 of_estimate = k > 0 ? static_cast<size_t>(k) : 0;
    const double steps = step_squares(pair, of_reference, of_estimate, n);
    const auto found = aligned_agreement(
        {thinned(pair.reference, of_reference, n), thinned(pair.estimate, of_estimate, n)}, all);
    return std::pair(found ? std::optional(found->squares) : std::nullopt, steps);
  };
  const auto [squares_0, steps_0] = shifted(0);
  // Where the speed changes steadily, a change of scale resembles a shift.
  const auto scaled =
      aligned_agreement({thinned(reference, 0, n), thinned(estimate, 0, n)}, choice.with(Alignment::sim3));
  constexpr double of_path = 25;
  const double by_place = squares_of_place(pair, all);
  std::vector<Reading> readings;
  for (int k = -most_rows; k <= most_rows; ++k) {
    if (k == 0) continue;
    const auto [squares, steps] = shifted(k);
    const std::string cause = fmt::format("the estimate is {} by {} frame{}", k > 0 ? "late" : "early",
                                          std::abs(k), std::abs(k) > 1 ? "s" : "");
    const bool exceeds_scale = squares && (!scaled || *squares < scaled->squares);
    const bool by_path =
        exceeds_scale && squares_0 && explains_times * *squares <= *squares_0 && confirmed * steps <= steps_0;
    const bool by_steps =
        explains_times * steps <= steps_0 && (!squares || !squares_0 || *squares <= 1.01 * *squares_0);
    // Where independent errors of the poses hide the steps, the path decides, if no other place of the world
    // or of the body explains it.
    const bool by_path_alone = exceeds_scale && squares_0 && of_path * *squares <= *squares_0 &&
                               explains_times * *squares <= by_place;
    if (by_path || by_steps || by_path_alone) readings.push_back({"lag", cause, correction(-k), steps, 0});
  }
  const auto best = std::ranges::min_element(readings, {}, &Reading::residual);
  if (best == readings.end() || !(steps_0 > 1e-12)) return std::nullopt;
  return DataWarning{
      "lag", fmt::format("{}: {} (RMS difference of the steps {:.3g} m read so, {:.3g} m as declared)",
                         best->cause, best->remedy, std::sqrt(best->residual), std::sqrt(steps_0))};
}

}  // namespace sextant
