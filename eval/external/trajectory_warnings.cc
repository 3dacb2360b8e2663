#include "sextant/eval/external/trajectory_warnings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <span>

#include "sextant/base/error.h"

namespace sextant {
namespace {

bool has_any(const std::string& text, std::initializer_list<std::string_view> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return text.find(word) != std::string::npos; });
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Whether "gt" stands in a file name as a word of its own.
bool has_word(const std::string& name, std::string_view word) {
  const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
  for (size_t at = name.find(word); at != std::string::npos; at = name.find(word, at + 1)) {
    const size_t end = at + word.size();
    if ((at == 0 || !is_letter(name[at - 1])) && (end == name.size() || !is_letter(name[end]))) return true;
  }
  return false;
}

bool claims_truth(const TrajectorySide& side) {
  const std::string name = lower(std::filesystem::path(side.name).filename());
  return has_any(name, {"groundtruth", "ground_truth", "ground-truth"}) || has_word(name, "gt") ||
         has_any(side.comments, {"ground truth", "groundtruth"});
}

bool claims_estimate(const TrajectorySide& side) {
  const std::string name = lower(std::filesystem::path(side.name).filename());
  return !claims_truth(side) &&
         (has_word(name, "est") || has_any(name, {"estimate", "slam", "odometry", "keyframetrajectory"}));
}

double median_step(const std::vector<double>& times) {
  std::vector<double> steps;
  for (size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  const auto half = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), half, steps.end());
  return *half;
}

// ---- lag

/// Length of path and sum of angles up to each time: differences of them give motion over any interval.
struct Motion {
  std::vector<double> times, path_m, angle_rad;

  std::array<double, 2> at(double time) const {
    const auto after = std::upper_bound(times.begin(), times.end(), time);
    const auto i = static_cast<size_t>(
        std::clamp<std::ptrdiff_t>(after - times.begin(), 1, static_cast<std::ptrdiff_t>(times.size()) - 1));
    const double w = (time - times[i - 1]) / (times[i] - times[i - 1]);
    return {path_m[i - 1] + w * (path_m[i] - path_m[i - 1]),
            angle_rad[i - 1] + w * (angle_rad[i] - angle_rad[i - 1])};
  }
};

constexpr size_t kMostSteps = 1000;  // of long recordings the first ones

/// How many windows to shift to each side: 20, or 1 s where that is more.
int shifts(double duration_s, double width_s) {
  constexpr int kFewest = 20, kMost = 200;
  const double reach_s = std::min(1.0, duration_s / 4);
  return std::clamp(static_cast<int>(reach_s / width_s), kFewest, kMost);
}

Motion motion_of(const PoseSeries& series, const std::vector<double>& times, double until) {
  Motion motion{{times[0]}, {0.0}, {0.0}};
  for (size_t i = 1; i < series.size() && times[i - 1] <= until; ++i) {
    const RelativePose step = relative_pose(series, i - 1, i);
    motion.times.push_back(times[i]);
    motion.path_m.push_back(motion.path_m.back() + step.translation_m.norm());
    motion.angle_rad.push_back(motion.angle_rad.back() +
                               rotation_angle_rad(Eigen::Quaterniond(step.rotation)));
  }
  return motion;
}

double correlation(std::span<const double> x, std::span<const double> y) {
  const auto n = static_cast<double>(x.size());
  double mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  for (size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    yy += (y[i] - my) * (y[i] - my);
    xy += (x[i] - mx) * (y[i] - my);
  }
  return xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

/// Path (m) and rotation (rad) within windows of time: window i is [begin + i step, begin + i step + width].
std::array<std::vector<double>, 2> motion_in_windows(const Motion& motion, double begin, double step,
                                                     double width, size_t n) {
  std::array<std::vector<double>, 2> out;
  for (size_t i = 0; i < n; ++i) {
    const double t = begin + static_cast<double>(i) * step;
    const auto a = motion.at(t), b = motion.at(t + width);
    for (size_t k = 0; k < 2; ++k) out[k].push_back(b[k] - a[k]);
  }
  return out;
}

/// Top of the parabola through the best score and its neighbours, relative to it, -0.5 .. 0.5.
double peak_offset(const std::vector<double>& scores, std::vector<double>::const_iterator best) {
  if (best == scores.begin() || best + 1 == scores.end()) return 0;
  const double before = best[-1], after = best[1], bend = before - 2 * *best + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

}  // namespace

std::optional<LagEstimate> estimate_lag(const PoseSeries& reference,
                                        const std::vector<double>& reference_times,
                                        const PoseSeries& estimate,
                                        const std::vector<double>& estimate_times) {
  constexpr size_t kLeastPoses = 40;
  if (reference.size() < kLeastPoses || estimate.size() < kLeastPoses) return std::nullopt;
  const double width = std::max(median_step(reference_times), median_step(estimate_times));
  if (!(width > 0)) return std::nullopt;
  const int n_shifts = shifts(std::min(reference_times.back() - reference_times.front(),
                                       estimate_times.back() - estimate_times.front()),
                              width);
  const double reach = n_shifts * width;
  const double begin = std::max(reference_times.front(), estimate_times.front() + reach);
  double end = std::min(reference_times.back(), estimate_times.back() - reach);
  end = std::min(end, begin + width * kMostSteps);
  if (!(end - begin > 20 * width)) return std::nullopt;
  const auto n = static_cast<size_t>((end - begin) / width);
  const auto r =
      motion_in_windows(motion_of(reference, reference_times, end + width), begin, width, width, n);
  const auto shift_count = static_cast<size_t>(2 * n_shifts + 1);
  const auto e = motion_in_windows(motion_of(estimate, estimate_times, end + reach + width), begin - reach,
                                   width, width, n + shift_count);
  std::vector<double> scores;
  for (size_t shift = 0; shift < shift_count; ++shift) {
    double score = 0;
    for (size_t k = 0; k < 2; ++k) score += 0.5 * correlation(r[k], std::span(e[k]).subspan(shift, n));
    scores.push_back(score);
  }
  const auto best = std::max_element(scores.begin(), scores.end());
  const auto k = static_cast<int>(best - scores.begin()) - n_shifts;
  const LagEstimate lag{(k + peak_offset(scores, best)) * width, *best,
                        scores[static_cast<size_t>(n_shifts)]};
  // Smooth motions correlate well also without the shift; then it must explain half of what is left.
  const double gain = lag.correlation - lag.correlation_0;
  const bool explains = gain > 0.1 || (gain > 5e-4 && gain > 0.5 * (1 - lag.correlation_0));
  if (k == 0 || lag.correlation < 0.8 || !explains) return std::nullopt;
  return lag;
}

std::vector<TrajectoryWarning> warnings_of_pair(const PoseSeries& reference,
                                                const TrajectorySide& reference_side,
                                                const PoseSeries& estimate,
                                                const TrajectorySide& estimate_side) {
  std::vector<TrajectoryWarning> warnings;
  const bool by_name = (claims_truth(estimate_side) && !claims_truth(reference_side)) ||
                       (claims_estimate(reference_side) && !claims_estimate(estimate_side));
  if (by_name) {
    warnings.push_back(
        {"swapped", fmt::format("{} looks like the ground truth and {} like an estimate by their names "
                                "or comments: are they swapped? The reference comes first",
                                estimate_side.name, reference_side.name)});
  }
  const std::vector<double>&a = reference.stamps_s, &b = estimate.stamps_s;
  if (a.size() < 3 || b.size() < 3) return warnings;
  const double step_a = median_step(a), step_b = median_step(b);
  if (!(step_a > 0) || !(step_b > 0)) return warnings;
  const double ratio = step_a / step_b;
  const bool longer = b.back() - b.front() > 1.02 * (a.back() - a.front());
  if (!by_name && ratio > 1.5 && longer) {
    warnings.push_back(
        {"swapped", fmt::format("the estimate {} is denser ({:.4g} Hz against {:.4g} Hz) and longer than "
                                "the reference {}, as ground truth usually is: are they swapped? The "
                                "reference comes first",
                                estimate_side.name, 1 / step_b, 1 / step_a, reference_side.name)});
  }
  if (ratio > 1.5 || ratio < 1 / 1.5) {
    warnings.push_back(
        {"rates",
         fmt::format("different rates: reference {:.4g} Hz, estimate {:.4g} Hz; poses are matched at "
                     "the lower one, and relative errors in frames span its steps",
                     1 / step_a, 1 / step_b)});
  }
  return warnings;
}

std::vector<TrajectoryWarning> warnings_of_matched(const PoseSeries& reference, const PoseSeries& estimate) {
  std::vector<TrajectoryWarning> warnings;
  const auto is_identity = [&](size_t i) {
    return reference.positions_m[i].isZero(0) && reference.rotations[i] == Eigen::Matrix3d::Identity();
  };
  const auto equal = [](const PoseSeries& s, size_t i, const PoseSeries& t, size_t j) {
    return s.positions_m[i] == t.positions_m[j] && s.rotations[i] == t.rotations[j];
  };
  size_t identities = 0, repeated = 0, first_repeated = 0, same = 0;
  // A recording may stand at its origin first, as long as the estimate does.
  constexpr double kStands_m = 0.5;
  bool left_origin = false;
  for (size_t i = 0; i < estimate.size(); ++i) {
    same += equal(reference, i, estimate, i);
    if (i == 0) continue;
    left_origin = left_origin || !is_identity(i) ||
                  (estimate.positions_m[i] - estimate.positions_m[0]).norm() > kStands_m;
    identities += left_origin && is_identity(i);
    if (!equal(estimate, i, estimate, i - 1)) continue;
    constexpr double kMoves_m = 0.01, kTurns_rad = 0.001;
    const RelativePose step = relative_pose(reference, i - 1, i);
    if (step.translation_m.norm() < kMoves_m &&
        rotation_angle_rad(Eigen::Quaterniond(step.rotation)) < kTurns_rad)
      continue;
    if (repeated++ == 0) first_repeated = i;
  }
  if (repeated >= 5) {
    warnings.push_back(
        {"repeated_poses", fmt::format("the estimate repeats its last pose exactly {} times while the "
                                       "reference moves, first at matched pose {}: a lost tracker? Leave "
                                       "lost poses out, then they count against coverage",
                                       repeated, first_repeated)});
  }
  if (identities > 0) {
    warnings.push_back({"identity", fmt::format("{} reference poses are exactly the identity: missing truth "
                                                "that was logged as identity? These errors mean nothing",
                                                identities)});
  }
  if (same == estimate.size() && estimate.size() > 1)
    warnings.push_back({"identical", "all poses of estimate and reference are equal: the same file twice?"});
  return warnings;
}

}  // namespace sextant
