#include "sextant/eval/evaluation/trajectory_offset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"

namespace sextant {

double median_step(const std::vector<double>& times) {
  std::vector<double> steps;
  for (size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return middle_of(steps);
}

namespace {

/// Length (m) and angle (rad) of the step to pose i; the angle is 0 without rotations.
std::array<double, 2> step_of(const PoseSeries& series, size_t i) {
  if (!series.has_rotations()) return {(series.positions_m[i] - series.positions_m[i - 1]).norm(), 0};
  const RelativePose step = relative_pose(series, i - 1, i);
  return {step.translation_m.norm(), rotation_angle_rad(Eigen::Quaterniond(step.rotation))};
}

/// Path length and sum of rotation angles up to each time; differences give the motion over any interval.
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

constexpr size_t max_steps = 1000;  // longer recordings are compared over their first steps only

/// Number of windows to shift to each side: 20, or 1 s if that is longer.
int shifts(double duration_s, double width_s) {
  constexpr int fewest = 20, most = 200;
  const double reach_s = std::min(1.0, duration_s / 4);
  return std::clamp(static_cast<int>(reach_s / width_s), fewest, most);
}

Motion motion_of(const PoseSeries& series, const std::vector<double>& times, double until) {
  Motion motion{{times[0]}, {0.0}, {0.0}};
  for (size_t i = 1; i < series.size() && times[i - 1] <= until; ++i) {
    const auto [length_m, angle_rad] = step_of(series, i);
    motion.times.push_back(times[i]);
    motion.path_m.push_back(motion.path_m.back() + length_m);
    motion.angle_rad.push_back(motion.angle_rad.back() + angle_rad);
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

/// Position of the maximum of the parabola through the best score and its neighbours, relative to the best
/// one, in -0.5 .. 0.5.
double peak_offset(const std::vector<double>& scores, std::vector<double>::const_iterator best) {
  if (best == scores.begin() || best + 1 == scores.end()) return 0;
  const double before = best[-1], after = best[1], bend = before - 2 * *best + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

// ---- offset

/// Speed and rotation rate of the steps between poses, at the middle of each step.
struct Rates {
  std::vector<double> times, durations;
  std::array<std::vector<double>, 2> values;  // m/s, rad/s
};

Rates rates_of(const PoseSeries& series) {
  Rates out;
  for (size_t i = 1; i < series.size(); ++i) {
    const double duration = series.stamps_s[i] - series.stamps_s[i - 1];
    if (!(duration > 0)) continue;
    const auto [length_m, angle_rad] = step_of(series, i);
    out.times.push_back(0.5 * (series.stamps_s[i] + series.stamps_s[i - 1]));
    out.durations.push_back(duration);
    out.values[0].push_back(length_m / duration);
    out.values[1].push_back(angle_rad / duration);
  }
  return out;
}

using Signals = std::array<std::vector<double>, 2>;

/// Signals smoothed by a Gaussian of deviation `width`, cut at five deviations, and sampled at begin + i
/// width + shift. NaN if no step is near.
Signals smoothed(const Rates& rates, double begin, double width, size_t n, double shift) {
  constexpr double reach = 5;
  Signals out;
  size_t first = 0;
  for (size_t i = 0; i < n; ++i) {
    const double t = begin + static_cast<double>(i) * width + shift;
    while (first < rates.times.size() && rates.times[first] < t - reach * width) ++first;
    double weight = 0, sums[2] = {0, 0};
    for (size_t k = first; k < rates.times.size() && rates.times[k] <= t + reach * width; ++k) {
      const double u = (rates.times[k] - t) / width, w = std::exp(-0.5 * u * u) * rates.durations[k];
      weight += w;
      for (size_t c = 0; c < 2; ++c) sums[c] += w * rates.values[c][k];
    }
    for (size_t c = 0; c < 2; ++c) out[c].push_back(sums[c] / weight);
  }
  return out;
}

/// The score of an offset between two recordings. Offsets are relative to the initial one, which may be large
/// (an epoch) and would leave few digits.
class OffsetSearch {
 public:
  OffsetSearch(const PoseSeries& reference, const PoseSeries& estimate, double initial_s)
      : reference_(rates_of(reference)), estimate_(rates_of(estimate)) {
    width_ = std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s));
    for (double& t : estimate_.times) t += initial_s;
    const double duration = std::min(reference.stamps_s.back() - reference.stamps_s.front(),
                                     estimate.stamps_s.back() - estimate.stamps_s.front());
    reach_ = shifts(duration, width_) * width_;
    if (!(width_ > 0)) return;
    begin_ = std::max(estimate_.times.front(), reference_.times.front() + reach_);
    const double end = std::min(estimate_.times.back(), reference_.times.back() - reach_);
    if (end > begin_) n_ = std::min(static_cast<size_t>((end - begin_) / width_) + 1, max_samples);
    signal_ = smoothed(estimate_, begin_, width_, n_, 0);
  }

  size_t n() const { return n_; }
  double reach() const { return reach_; }
  double width() const { return width_; }

  /// Correlations at the offset `d`, leaving out the samples from `left_out` to `until`.
  std::array<double, 2> correlations(double d, size_t left_out = 0, size_t until = 0) const {
    const Signals r = smoothed(reference_, begin_, width_, n_, d);
    std::array<double, 2> rho{};
    for (size_t c = 0; c < 2; ++c) {
      std::vector<double> a, b;
      for (size_t i = 0; i < n_; ++i) {
        if ((i >= left_out && i < until) || !std::isfinite(r[c][i]) || !std::isfinite(signal_[c][i]))
          continue;
        a.push_back(r[c][i]);
        b.push_back(signal_[c][i]);
      }
      rho[c] = std::clamp(correlation(a, b), 0.0, 1 - 1e-12);
    }
    return rho;
  }

  double score(double d, size_t left_out = 0, size_t until = 0) const {
    double sum = 0;
    for (const double rho : correlations(d, left_out, until)) sum -= std::log1p(-rho * rho);
    return 0.5 * static_cast<double>(n_ - (until - left_out)) * sum;
  }

  /// Best offset on a grid of half widths over the whole range.
  double coarse_best() const {
    double best = 0, highest = -std::numeric_limits<double>::infinity();
    const int steps = static_cast<int>(std::lround(2 * reach_ / width_));
    for (int k = -steps; k <= steps; ++k) {
      const double d = 0.5 * width_ * k, s = score(d);
      if (s > highest) {
        highest = s;
        best = d;
      }
    }
    return best;
  }

  /// Golden-section search within half a width of `d`.
  double refined(double d, size_t left_out = 0, size_t until = 0) const {
    constexpr double golden = 0.6180339887498949;
    double low = d - 0.5 * width_, high = d + 0.5 * width_;
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double at_a = score(a, left_out, until), at_b = score(b, left_out, until);
    while (high - low > 1e-6 * width_) {
      if (at_a > at_b) {
        high = b;
        b = a;
        at_b = at_a;
        a = high - golden * (high - low);
        at_a = score(a, left_out, until);
      } else {
        low = a;
        a = b;
        at_a = at_b;
        b = low + golden * (high - low);
        at_b = score(b, left_out, until);
      }
    }
    return 0.5 * (low + high);
  }

 private:
  static constexpr size_t max_samples = 4000;  // longer recordings are compared over their first samples only

  Rates reference_, estimate_;
  double width_ = 0, reach_ = 0, begin_ = 0;
  size_t n_ = 0;
  Signals signal_;  // signal of the estimate
};

}  // namespace

std::optional<LagEstimate> estimate_lag(const PoseSeries& reference,
                                        const std::vector<double>& reference_times,
                                        const PoseSeries& estimate,
                                        const std::vector<double>& estimate_times) {
  constexpr size_t least_poses = 40;
  if (reference.size() < least_poses || estimate.size() < least_poses) return std::nullopt;
  const double width = std::max(median_step(reference_times), median_step(estimate_times));
  if (!(width > 0)) return std::nullopt;
  const int n_shifts = shifts(std::min(reference_times.back() - reference_times.front(),
                                       estimate_times.back() - estimate_times.front()),
                              width);
  const double reach = n_shifts * width;
  const double begin = std::max(reference_times.front(), estimate_times.front() + reach);
  double end = std::min(reference_times.back(), estimate_times.back() - reach);
  end = std::min(end, begin + width * max_steps);
  if (!(end - begin > 20 * width)) return std::nullopt;
  const auto n = static_cast<size_t>((end - begin) / width);
  const auto r =
      motion_in_windows(motion_of(reference, reference_times, end + width), begin, width, width, n);
  const auto shift_count = static_cast<size_t>(2 * n_shifts + 1);
  const auto e = motion_in_windows(motion_of(estimate, estimate_times, end + reach + width), begin - reach,
                                   width, width, n + shift_count);
  const bool rotations = reference.has_rotations() && estimate.has_rotations();
  std::vector<double> scores;
  for (size_t shift = 0; shift < shift_count; ++shift) {
    double score = 0;
    for (size_t k = 0; k < (rotations ? 2 : 1); ++k)
      score += (rotations ? 0.5 : 1) * correlation(r[k], std::span(e[k]).subspan(shift, n));
    scores.push_back(score);
  }
  const auto best = std::max_element(scores.begin(), scores.end());
  const auto k = static_cast<int>(best - scores.begin()) - n_shifts;
  const LagEstimate lag{(k + peak_offset(scores, best)) * width, *best,
                        scores[static_cast<size_t>(n_shifts)]};
  // Smooth motions correlate well without a shift too; then the shift must explain half of the remaining
  // difference to 1.
  const double gain = lag.correlation - lag.correlation_0;
  const bool explains = gain > 0.1 || (gain > 5e-4 && gain > 0.5 * (1 - lag.correlation_0));
  if (k == 0 || lag.correlation < 0.8 || !explains) return std::nullopt;
  return lag;
}

OffsetEstimate estimate_offset(const PoseSeries& reference, const PoseSeries& estimate, double initial_s,
                               const std::string& name) {
  constexpr size_t fewest = 40, n_stretches = 20;
  constexpr double least_correlation = 0.8, student_19 = 2.0930240544;
  const auto undetermined = [&](const std::string& why) {
    fail("{}: the motions do not determine a time offset: {}; give --offset", name, why);
  };
  if (reference.size() < fewest || estimate.size() < fewest)
    undetermined(fmt::format("{} and {} poses, {} needed", reference.size(), estimate.size(), fewest));
  const OffsetSearch search(reference, estimate, initial_s);
  if (search.n() < fewest)
    undetermined(fmt::format("both recordings share {} steps around an offset of {} s, {} needed", search.n(),
                             initial_s, fewest));
  const double coarse = search.coarse_best();
  if (std::abs(coarse) > search.reach() - 0.75 * search.width())
    undetermined(fmt::format("the best within {:.3g} s of {} s is at the end of that range", search.reach(),
                             initial_s));
  OffsetEstimate out;
  out.n = search.n();
  const double shift_s = search.refined(coarse);
  out.offset_s = initial_s + shift_s;
  const auto [speed, rotation] = search.correlations(shift_s);
  out.speed_correlation = speed;
  out.rotation_correlation = rotation;
  if (!(std::max(speed, rotation) >= least_correlation)) {
    undetermined(fmt::format("speeds correlate at {:.2f}, rotation rates at {:.2f} at best, {} needed", speed,
                             rotation, least_correlation));
  }
  double sum = 0, squares = 0;
  for (size_t k = 0; k < n_stretches; ++k) {
    const double d =
        search.refined(shift_s, k * out.n / n_stretches, (k + 1) * out.n / n_stretches) - shift_s;
    sum += d;
    squares += d * d;
  }
  constexpr double n = n_stretches;
  const double half = student_19 * std::sqrt((n - 1) / n * std::max(0.0, squares - sum * sum / n));
  out.low_s = out.offset_s - half;
  out.high_s = out.offset_s + half;
  return out;
}

}  // namespace sextant
