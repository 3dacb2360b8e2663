#include "sextant/stats/change_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

double noise_of(std::span<const double> values) {
  std::vector<double> steps;
  for (size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  return 1.4826 * mad(steps) / std::sqrt(2.0);
}

double deviations_from_median(const std::vector<double>& sorted) {
  const double middle = quantile_of_sorted(sorted, 0.5);
  double sum = 0;
  for (const double value : sorted) sum += std::abs(value - middle);
  return sum;
}

/// Joins neighbours whose medians differ by less than `min_step`, the nearest first.
void drop_small_steps(std::span<const double> values, double min_step, std::vector<size_t>& cuts) {
  while (!cuts.empty()) {
    std::vector<double> medians;
    for (size_t i = 0; i <= cuts.size(); ++i) {
      const size_t begin = i == 0 ? 0 : cuts[i - 1], end = i == cuts.size() ? values.size() : cuts[i];
      medians.push_back(median(values.subspan(begin, end - begin)));
    }
    size_t smallest = 0;
    const auto step = [&](size_t i) { return std::abs(medians[i + 1] - medians[i]); };
    for (size_t i = 1; i < cuts.size(); ++i) smallest = step(i) < step(smallest) ? i : smallest;
    if (step(smallest) >= min_step) return;
    cuts.erase(cuts.begin() + static_cast<std::ptrdiff_t>(smallest));
  }
}

}  // namespace

std::vector<size_t> change_points(std::span<const double> values, double min_step) {
  if (!(min_step >= 0)) fail("change points: smallest step {}: must be >= 0", min_step);
  if (values.size() < 2) return {};
  check_sample(values, "change points");
  const size_t n = values.size();
  const double penalty = 2 + 2 * std::log(static_cast<double>(n));
  const double scale = std::max(noise_of(values), min_step / penalty);
  if (!(scale > 0)) {  // no noise: every step counts
    std::vector<size_t> all;
    for (size_t i = 1; i < n; ++i) {
      if (values[i] != values[i - 1]) all.push_back(i);
    }
    return all;
  }
  // best[t]: cost of the first t values; from[t]: where their last segment begins.
  std::vector<double> best(n + 1, std::numeric_limits<double>::infinity());
  std::vector<size_t> from(n + 1, 0);
  best[0] = -penalty;
  for (size_t t = 1; t <= n; ++t) {
    std::vector<double> segment;
    for (size_t s = t; s-- > 0;) {
      segment.insert(std::ranges::upper_bound(segment, values[s]), values[s]);
      const double cost = best[s] + penalty + deviations_from_median(segment) / scale;
      if (cost <= best[t]) {  // of equal ones the longest segment
        best[t] = cost;
        from[t] = s;
      }
    }
  }
  std::vector<size_t> cuts;
  for (size_t t = from[n]; t > 0; t = from[t]) cuts.push_back(t);
  std::ranges::reverse(cuts);
  drop_small_steps(values, min_step, cuts);
  return cuts;
}

}  // namespace sextant
