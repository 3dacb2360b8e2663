#include "sextant/eval/evaluation/trajectory_offset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"

namespace sextant {

double median_step(const std::vector<double>& times) {
  std::vector<double> steps;
  for (size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return upper_median(steps);
}

std::string interpolate_flag(const std::vector<double>& reference_stamps_s) {
  return fmt::format("--interpolate {:.3g}", 1.5 * median_step(reference_stamps_s));
}

namespace {

/// Length (m) and angle (rad) of the step to pose i; the angle is 0 without rotations.
std::array<double, 2> step_of(const PoseSeries& series, size_t i) {
  if (!series.has_rotations()) return {(series.positions_m[i] - series.positions_m[i - 1]).norm(), 0};
  const RelativePose step = relative_pose(series, i - 1, i);
  return {step.translation_m.norm(), rotation_angle_rad(Eigen::Quaterniond(step.rotation))};
}

/// Returns the longest step between poses, s, that is no gap of the recording.
double longest_step(const std::vector<double>& reference_times, const std::vector<double>& estimate_times) {
  constexpr double steps = 10;
  return steps * std::max(median_step(reference_times), median_step(estimate_times));
}

/// Path length and sum of rotation angles up to each time; differences give the motion over any interval.
struct Motion {
  std::vector<double> times, path_m, angle_rad;
  double longest_step_s = 0;

  /// Returns NaN within a gap, where the motion is unknown.
  std::array<double, 2> at(double time) const {
    const auto after = std::upper_bound(times.begin(), times.end(), time);
    const auto i = static_cast<size_t>(
        std::clamp<std::ptrdiff_t>(after - times.begin(), 1, static_cast<std::ptrdiff_t>(times.size()) - 1));
    const double step = times[i] - times[i - 1];
    if (step > longest_step_s) {
      constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
      return {unknown, unknown};
    }
    const double w = (time - times[i - 1]) / step;
    return {path_m[i - 1] + w * (path_m[i] - path_m[i - 1]),
            angle_rad[i - 1] + w * (angle_rad[i] - angle_rad[i - 1])};
  }
};

constexpr double least_correlation = 0.8;

/// Number of windows to shift to each side: 20, or 1 s if that is longer.
int shifts(double duration_s, double width_s) {
  constexpr int fewest = 20, most = 200;
  const double reach_s = std::min(1.0, duration_s / 4);
  return std::clamp(static_cast<int>(reach_s / width_s), fewest, most);
}

Motion motion_of(const PoseSeries& series, const std::vector<double>& times, double longest_step_s) {
  Motion motion{{times[0]}, {0.0}, {0.0}, longest_step_s};
  for (size_t i = 1; i < series.size(); ++i) {
    const auto [length_m, angle_rad] = step_of(series, i);
    motion.times.push_back(times[i]);
    motion.path_m.push_back(motion.path_m.back() + length_m);
    motion.angle_rad.push_back(motion.angle_rad.back() + angle_rad);
  }
  return motion;
}

/// Returns the correlation of the pairs of finite values; 0 for fewer than `fewest` of them.
double correlation(std::span<const double> x, std::span<const double> y, std::ptrdiff_t fewest) {
  double mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
  std::ptrdiff_t n = 0;
  const auto is_known = [&](size_t i) { return std::isfinite(x[i]) && std::isfinite(y[i]); };
  for (size_t i = 0; i < x.size(); ++i) {
    if (!is_known(i)) continue;
    mx += x[i];
    my += y[i];
    ++n;
  }
  if (n < fewest) return 0;
  mx /= static_cast<double>(n);
  my /= static_cast<double>(n);
  for (size_t i = 0; i < x.size(); ++i) {
    if (!is_known(i)) continue;
    xx += (x[i] - mx) * (x[i] - mx);
    yy += (y[i] - my) * (y[i] - my);
    xy += (x[i] - mx) * (y[i] - my);
  }
  return xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

/// Path (m) and rotation (rad) within windows of time: window i is [begin + i width, begin + (i + 1) width].
std::array<std::vector<double>, 2> motion_in_windows(const Motion& motion, double begin, double width,
                                                     size_t n) {
  std::array<std::vector<double>, 2> out;
  for (size_t i = 0; i < n; ++i) {
    const double t = begin + static_cast<double>(i) * width;
    const auto a = motion.at(t), b = motion.at(t + width);
    for (size_t k = 0; k < 2; ++k) out[k].push_back(b[k] - a[k]);
  }
  return out;
}

std::ptrdiff_t count_finite(const std::vector<double>& values) {
  return std::ranges::count_if(values, [](double value) { return std::isfinite(value); });
}

/// Returns the centre of the search for a shift of the estimate's times: 0, or a shift beyond `reach` that
/// explains the motions much better (trajectory_offset.h); empty if it does not explain them so much better
/// that it is certain. Windows of four time steps are compared, at shifts by single steps.
std::optional<double> centre_of_search(const PoseSeries& reference,
                                       const std::vector<double>& reference_times, const PoseSeries& estimate,
                                       const std::vector<double>& estimate_times, double reach) {
  constexpr double most_windows = 2000, clearly_less = 0.5, less = 0.8;
  constexpr std::ptrdiff_t fewest_windows = 20, shifts_per_window = 4;
  const double reference_span = reference_times.back() - reference_times.front();
  const double estimate_span = estimate_times.back() - estimate_times.front();
  const double width = std::max({shifts_per_window * median_step(reference_times),
                                 shifts_per_window * median_step(estimate_times),
                                 std::max(reference_span, estimate_span) / most_windows});
  const auto n_r = static_cast<std::ptrdiff_t>(reference_span / width) - 1;
  const auto n_e = static_cast<std::ptrdiff_t>(estimate_span / width);
  if (std::min(n_r, n_e) < fewest_windows) return 0;
  const double longest_step_s = longest_step(reference_times, estimate_times);
  const Motion of_reference = motion_of(reference, reference_times, longest_step_s);
  const auto e = motion_in_windows(motion_of(estimate, estimate_times, longest_step_s),
                                   estimate_times.front(), width, static_cast<size_t>(n_e));
  double near = 1, far = 1, best = 0, best_correlation = 0;
  for (std::ptrdiff_t phase = 0; phase < shifts_per_window; ++phase) {
    const double begin = reference_times.front() + static_cast<double>(phase) * width / shifts_per_window;
    const auto r = motion_in_windows(of_reference, begin, width, static_cast<size_t>(n_r));
    const std::ptrdiff_t fewest =
        std::max(fewest_windows, std::min(count_finite(r[0]), count_finite(e[0])) / 2);
    for (std::ptrdiff_t k = -n_e; k <= n_r; ++k) {  // window i of the estimate is i + k of the reference
      const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, k);
      if (std::min(n_r, n_e + k) - first < fewest) continue;
      const auto n = static_cast<size_t>(std::min(n_r, n_e + k) - first);
      double unexplained = 1, highest = 0;
      for (size_t c = 0; c < 2; ++c) {
        const double rho = correlation(std::span(r[c]).subspan(static_cast<size_t>(first), n),
                                       std::span(e[c]).subspan(static_cast<size_t>(first - k), n), fewest);
        highest = std::max(highest, rho);
        if (rho > 0) unexplained *= 1 - rho * rho;
      }
      const double shift = begin - estimate_times.front() + static_cast<double>(k) * width;
      if (std::abs(shift) <= reach) {
        near = std::min(near, unexplained);
      } else if (unexplained < far) {
        far = unexplained;
        best = shift;
        best_correlation = highest;
      }
    }
  }
  if (best_correlation < least_correlation || far > less * near) return 0;
  return far <= clearly_less * near ? std::optional(best) : std::nullopt;
}

// ---- offset

/// Speed and rotation rate of the steps between poses, at the middle of each step; gaps are left out.
struct Rates {
  std::vector<double> times, durations;
  std::array<std::vector<double>, 2> values;  // m/s, rad/s
};

Rates rates_of(const PoseSeries& series, double longest_step_s) {
  Rates out;
  for (size_t i = 1; i < series.size(); ++i) {
    const double duration = series.stamps_s[i] - series.stamps_s[i - 1];
    if (!(duration > 0 && duration <= longest_step_s)) continue;
    const auto [length_m, angle_rad] = step_of(series, i);
    out.times.push_back(0.5 * (series.stamps_s[i] + series.stamps_s[i - 1]));
    out.durations.push_back(duration);
    out.values[0].push_back(length_m / duration);
    out.values[1].push_back(angle_rad / duration);
  }
  return out;
}

using Signals = std::array<std::vector<double>, 2>;

/// Appends signals smoothed by a Gaussian of deviation `width`, cut at five deviations, and sampled at
/// start + i width. NaN if no step is near.
void append_smoothed(Signals& out, const Rates& rates, double start, double width, size_t n) {
  // A step at g samples from the nearest one, |g| <= 1/2, has at the sample m before that one the weight
  // exp(-(m + g)^2 / 2) = exp(-m^2 / 2) exp(-g)^m exp(-g^2 / 2): two exponentials serve all samples.
  constexpr int reach = 5;
  static const auto gaussian = [] {
    std::array<double, reach + 1> values;
    for (int m = 0; m <= reach; ++m) values[m] = std::exp(-0.5 * m * m);
    return values;
  }();
  struct Sum {
    double weight = 0;
    std::array<double, 2> values{};
  };
  constexpr int margin = 2 * reach;  // samples before the first and after the last one
  std::vector<Sum> sums(n + 2 * margin);
  const auto first = std::lower_bound(rates.times.begin(), rates.times.end(), start - reach * width);
  for (auto k = static_cast<size_t>(first - rates.times.begin()); k < rates.times.size(); ++k) {
    const double at = (rates.times[k] - start) / width;
    const double nearest = std::round(at), g = at - nearest;
    if (nearest >= static_cast<double>(n + reach)) break;
    Sum* const centre = &sums[static_cast<size_t>(nearest + margin)];
    const auto add = [&](std::ptrdiff_t sample, double weight) {
      Sum& sum = centre[sample];
      sum.weight += weight;
      for (size_t c = 0; c < 2; ++c) sum.values[c] += weight * rates.values[c][k];
    };
    const double factor = std::exp(-g), inverse = 1 / factor;
    double before = std::exp(-0.5 * g * g) * rates.durations[k], after = before;
    add(0, before);
    for (int m = 1; m <= reach; ++m) {
      before *= factor;
      after *= inverse;
      if (m + g <= reach) add(-m, before * gaussian[m]);
      if (m - g <= reach) add(m, after * gaussian[m]);
    }
  }
  for (size_t i = 0; i < n; ++i) {
    const Sum& sum = sums[i + margin];
    for (size_t c = 0; c < 2; ++c) out[c].push_back(sum.values[c] / sum.weight);
  }
}

/// Sums of two signals and of their products over samples; the signals are about fixed values near their
/// means, which keeps the digits of the variances.
struct Moments {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;

  void add(double a, double b) {
    n += 1;
    x += a;
    y += b;
    xx += a * a;
    yy += b * b;
    xy += a * b;
  }
  /// Adds `sign` times the sums of other samples.
  void add(const Moments& other, double sign) {
    n += sign * other.n;
    x += sign * other.x;
    y += sign * other.y;
    xx += sign * other.xx;
    yy += sign * other.yy;
    xy += sign * other.xy;
  }
  /// 0 if it is negative or if a signal varies by no more than the rounding of its sums.
  double correlation() const {
    constexpr double rounding = 1e-12;
    const double vx = xx - x * x / n, vy = yy - y * y / n;
    const bool vary = vx > rounding * xx && vy > rounding * yy;
    return vary ? std::clamp((xy - x * y / n) / std::sqrt(vx * vy), 0.0, 1 - 1e-12) : 0;
  }
};

double mean_of_finite(const std::vector<double>& values) {
  double sum = 0, n = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    sum += value;
    n += 1;
  }
  return n > 0 ? sum / n : 0;
}

/// The score of an offset between two recordings. Offsets are relative to the initial one, which may be large
/// (an epoch) and would leave few digits.
class OffsetSearch {
 public:
  static constexpr int n_stretches = 20;  // of the jackknife
  static constexpr int nothing = -1;      // no stretch is left out

  OffsetSearch(const PoseSeries& reference, const PoseSeries& estimate, double initial_s)
      : width_(std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s))) {
    const double longest_step_s = longest_step(reference.stamps_s, estimate.stamps_s);
    reference_ = rates_of(reference, longest_step_s);
    estimate_ = rates_of(estimate, longest_step_s);
    for (double& t : estimate_.times) t += initial_s;
    const double duration = std::min(reference.stamps_s.back() - reference.stamps_s.front(),
                                     estimate.stamps_s.back() - estimate.stamps_s.front());
    reach_ = shifts(duration, width_) * width_;
    if (!(width_ > 0) || reference_.times.empty()) return;
    const std::vector<double>& times = estimate_.times;
    for (size_t first = 0, next = 0; next < times.size() && n_ < max_samples; first = next) {
      for (++next; next < times.size() && times[next] - times[next - 1] <= longest_step_s;) ++next;
      const double begin = std::max(times[first], reference_.times.front() + reach_);
      const double end = std::min(times[next - 1], reference_.times.back() - reach_);
      if (!(end > begin)) continue;
      parts_.push_back({begin, std::min(static_cast<size_t>((end - begin) / width_) + 1, max_samples - n_)});
      n_ += parts_.back().n;
    }
    signal_ = smoothed(estimate_, 0);
    for (size_t c = 0; c < 2; ++c) centre_[c] = mean_of_finite(signal_[c]);
  }

  size_t n() const { return n_; }
  double reach() const { return reach_; }
  double width() const { return width_; }

  /// Correlations at the offset `d` without one of the stretches.
  std::array<double, 2> correlations(double d, int left_out = nothing) {
    const Stretches& stretches = stretches_at(d);
    std::array<double, 2> rho{};
    for (size_t c = 0; c < 2; ++c) {
      Moments rest = stretches.all[c];
      if (left_out != nothing) rest.add(stretches.each[static_cast<size_t>(left_out)][c], -1);
      // Few samples, as of a shift into a gap of the reference, correlate by chance.
      if (2 * rest.n >= static_cast<double>(n_)) rho[c] = rest.correlation();
    }
    return rho;
  }

  double score(double d, int left_out = nothing) {
    double sum = 0;
    for (const double rho : correlations(d, left_out)) sum -= std::log1p(-rho * rho);
    const size_t without = left_out == nothing ? 0 : begin_of(left_out + 1) - begin_of(left_out);
    return 0.5 * static_cast<double>(n_ - without) * sum;
  }

  /// Grid of half widths over the whole range.
  std::vector<double> grid() const {
    std::vector<double> out;
    const int steps = static_cast<int>(std::lround(2 * reach_ / width_));
    for (int k = -steps; k <= steps; ++k) out.push_back(0.5 * width_ * k);
    return out;
  }

  double coarse_best() {
    double best = 0, highest = -std::numeric_limits<double>::infinity();
    for (const double d : grid()) {
      const double s = score(d);
      if (s > highest) {
        highest = s;
        best = d;
      }
    }
    return best;
  }

  /// Returns the standard error of a quantity by the jackknife: of(k) is its value without stretch k.
  template <typename Of>
  static double jackknife_error(const Of& of) {
    double sum = 0, squares = 0;
    for (int k = 0; k < n_stretches; ++k) {
      const double value = of(k);
      sum += value;
      squares += value * value;
    }
    constexpr double n = n_stretches;
    return std::sqrt((n - 1) / n * std::max(0.0, squares - sum * sum / n));
  }

  /// Golden-section search within half a width of `d`.
  double refined(double d, int left_out = nothing) {
    constexpr double golden = 0.6180339887498949;
    double low = d - 0.5 * width_, high = d + 0.5 * width_;
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double at_a = score(a, left_out), at_b = score(b, left_out);
    while (high - low > 1e-6 * width_) {
      if (at_a > at_b) {
        high = b;
        b = a;
        at_b = at_a;
        a = high - golden * (high - low);
        at_a = score(a, left_out);
      } else {
        low = a;
        a = b;
        at_a = at_b;
        b = low + golden * (high - low);
        at_b = score(b, left_out);
      }
    }
    return 0.5 * (low + high);
  }

 private:
  static constexpr size_t max_samples = 4000;  // longer recordings are compared over their first samples only

  /// Samples between two gaps of the estimate.
  struct Part {
    double begin;
    size_t n;
  };
  struct Stretches {
    std::array<Moments, 2> all;
    std::array<std::array<Moments, 2>, n_stretches> each;
  };

  size_t begin_of(int stretch) const { return static_cast<size_t>(stretch) * n_ / n_stretches; }

  Signals smoothed(const Rates& rates, double shift) const {
    Signals out;
    for (const Part& part : parts_) append_smoothed(out, rates, part.begin + shift, width_, part.n);
    return out;
  }

  /// Computes the sums at an offset once: the searches without one stretch begin at the same offsets.
  const Stretches& stretches_at(double d) {
    const auto [found, is_new] = known_.try_emplace(d);
    Stretches& out = found->second;
    if (!is_new) return out;
    const Signals r = smoothed(reference_, d);
    for (size_t c = 0; c < 2; ++c) {
      for (int k = 0; k < n_stretches; ++k) {
        Moments& moments = out.each[static_cast<size_t>(k)][c];
        for (size_t i = begin_of(k); i < begin_of(k + 1); ++i) {
          if (std::isfinite(r[c][i]) && std::isfinite(signal_[c][i]))
            moments.add(r[c][i] - centre_[c], signal_[c][i] - centre_[c]);
        }
        out.all[c].add(moments, 1);
      }
    }
    return out;
  }

  Rates reference_, estimate_;
  double width_ = 0, reach_ = 0;
  std::vector<Part> parts_;
  size_t n_ = 0;                    // samples of all parts
  Signals signal_;                  // signal of the estimate
  std::array<double, 2> centre_{};  // its mean
  std::map<double, Stretches> known_;
};

}  // namespace

OffsetEstimate estimate_offset(const PoseSeries& reference, const PoseSeries& estimate, double initial_s,
                               const std::string& name) {
  constexpr size_t fewest = 40;
  constexpr double student_19 = 2.0930240544;
  const auto undetermined = [&](const std::string& why) {
    fail("{}: the motions do not determine a time offset: {}; give --offset", name, why);
  };
  if (reference.size() < fewest || estimate.size() < fewest)
    undetermined(fmt::format("{} and {} poses, {} needed", reference.size(), estimate.size(), fewest));
  std::vector<double> times = estimate.stamps_s;
  for (double& t : times) t += initial_s;
  const auto centre = centre_of_search(reference, reference.stamps_s, estimate, times,
                                       OffsetSearch(reference, estimate, initial_s).reach());
  if (!centre) {
    undetermined(fmt::format("an offset far from {} s agrees better, but not clearly", initial_s));
  }
  initial_s += *centre;
  OffsetSearch search(reference, estimate, initial_s);
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
  const double half = student_19 * search.jackknife_error([&](int k) { return search.refined(shift_s, k); });
  // Offsets at which the score is not significantly lower: further maxima, or a plateau
  double low = shift_s - half, high = shift_s + half;
  for (const double d : search.grid()) {
    const double lower = search.score(shift_s) - search.score(d);
    const double error =
        search.jackknife_error([&](int k) { return search.score(shift_s, k) - search.score(d, k); });
    if (lower > student_19 * error) continue;
    low = std::min(low, d);
    high = std::max(high, d);
  }
  if (std::min(low + search.reach(), search.reach() - high) < 0.75 * search.width()) {
    undetermined(
        fmt::format("shifts of {:.3g} to {:.3g} s from {} s agree about as well: the motion is too uniform "
                    "there (use a longer recording), or the offset lies outside",
                    low, high, initial_s));
  }
  out.low_s = initial_s + low;
  out.high_s = initial_s + high;
  return out;
}

}  // namespace sextant
