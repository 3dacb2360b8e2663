#include "sextant/stats/summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "sextant/base/error.h"

namespace sextant {

void check_sample(std::span<const double> values, const char* what, size_t n_min) {
  if (values.size() < n_min) {
    fail("{}: needs at least {} value{}, got {}", what, n_min, n_min == 1 ? "" : "s", values.size());
  }
  for (size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i]))
      fail("{}: value {} of {} is {}, expected a finite number", what, i + 1, values.size(), values[i]);
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

double quantile(std::span<const double> values, double p) {
  check_sample(values, "quantile");
  std::vector<double> copy(values.begin(), values.end());
  return quantile_of(copy, p);
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

namespace {

/// Returns the lower ends of the bins between 1/2 and 1.
const std::array<double, LogHistogram::bins_per_octave>& ends_of_octave() {
  static const auto ends = [] {
    std::array<double, LogHistogram::bins_per_octave> out{};
    for (size_t j = 0; j < out.size(); ++j)
      out[j] = std::exp2(static_cast<double>(j) / LogHistogram::bins_per_octave - 1);
    return out;
  }();
  return ends;
}

}  // namespace

int LogHistogram::bin_of(double value) {
  if (!std::isfinite(value) || value < 0) fail("histogram: {}: expected a finite number >= 0", value);
  if (value == 0) return zero_bin;
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);  // 1/2 .. 1
  const auto& ends = ends_of_octave();
  const auto at = static_cast<int>(std::upper_bound(ends.begin(), ends.end(), mantissa) - ends.begin()) - 1;
  return (exponent - 1) * bins_per_octave + at;
}

double LogHistogram::centre(int bin) {
  return bin == zero_bin ? 0 : std::exp2((static_cast<double>(bin) + 0.5) / bins_per_octave);
}

void LogHistogram::add(const Bin& bin) {
  const auto at = std::ranges::lower_bound(bins_, bin.bin, {}, &Bin::bin);
  if (at != bins_.end() && at->bin == bin.bin) {
    at->n += bin.n;
  } else {
    bins_.insert(at, bin);
  }
}

uint64_t LogHistogram::n() const {
  uint64_t n = 0;
  for (const Bin& bin : bins_) n += bin.n;
  return n;
}

void SampleSums::add(double value) {
  ++n;
  sum += value;
  sum_squares += value * value;
  histogram.add(value);
}

}  // namespace sextant
