#include "sextant/stats/summary.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sextant/base/error.h"

namespace sextant {
namespace {

// Position of the quantile p among n sorted values: `below` and the share of the step to the next one.
struct Position {
  size_t below;
  double share;
};

Position position_of(double p, size_t n) {
  if (!(p >= 0 && p <= 1)) fail("quantile {}: must be in 0..1", p);
  const double position = static_cast<double>(n - 1) * p;
  const size_t below = std::min(static_cast<size_t>(position), n - 1);
  return {below, position - static_cast<double>(below)};
}

}  // namespace

void check_sample(std::span<const double> values, const char* what, size_t n_min) {
  if (values.size() < n_min) {
    fail("{}: needs at least {} value{}, got {}", what, n_min, n_min == 1 ? "" : "s", values.size());
  }
  for (size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) fail("{}: value {} of {} is {}", what, i + 1, values.size(), values[i]);
  }
}

double mean(std::span<const double> values) {
  check_sample(values, "mean");
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double rmse(std::span<const double> values) {
  check_sample(values, "rmse");
  double sum = 0;
  for (const double x : values) sum += x * x;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double std_dev(std::span<const double> values) {
  check_sample(values, "standard deviation", 2);
  const double centre = mean(values);
  double sum = 0;
  for (const double x : values) sum += (x - centre) * (x - centre);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

double quantile_of_sorted(std::span<const double> sorted, double p) {
  SEXTANT_CHECK(!sorted.empty());
  const auto [below, share] = position_of(p, sorted.size());
  const size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + share * (sorted[above] - sorted[below]);
}

double quantile(std::span<const double> values, double p) {
  check_sample(values, "quantile");
  std::vector<double> copy(values.begin(), values.end());
  const auto [below, share] = position_of(p, copy.size());
  const auto middle = copy.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(copy.begin(), middle, copy.end());
  const double above = middle + 1 == copy.end() ? *middle : *std::min_element(middle + 1, copy.end());
  return *middle + share * (above - *middle);
}

double median(std::span<const double> values) { return quantile(values, 0.5); }

double mad(std::span<const double> values) {
  const double centre = median(values);
  std::vector<double> deviations;
  for (const double x : values) deviations.push_back(std::abs(x - centre));
  return median(deviations);
}

std::vector<double> midranks(std::span<const double> values) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (size_t begin = 0; begin < order.size();) {
    size_t end = begin + 1;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    for (size_t i = begin; i < end; ++i) ranks[order[i]] = static_cast<double>(begin + 1 + end) / 2;
    begin = end;
  }
  return ranks;
}

}  // namespace sextant
