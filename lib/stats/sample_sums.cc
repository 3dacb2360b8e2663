#include "sextant/stats/sample_sums.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sextant/base/error.h"

namespace sextant {
namespace {

/// Lower ends of the bins from 1/2 to 1.
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
  if (!std::isfinite(value) || value < 0) fail("histogram: {}: expected a finite number of 0 or more", value);
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
