#pragma once

// Descriptive statistics of a sample x_1..x_n. All throw Error for an empty sample, for values that are not
// finite (a missing value must be left out by the caller, who then counts it) and where n is too small;
// none returns NaN.
//
//   mean      sum x / n                          rmse    sqrt(sum x^2 / n)
//   std_dev   sqrt(sum (x - mean)^2 / (n - 1)), n >= 2
//   quantile  type 7 of Hyndman and Fan (base/quantile.h)
//   median    quantile 1/2
//   mad       median |x - median|; times 1.4826 it estimates sigma of a normal

#include <cstdint>
#include <span>
#include <vector>

#include "sextant/base/quantile.h"

namespace sextant {

double mean(std::span<const double> values);
double rmse(std::span<const double> values);
double std_dev(std::span<const double> values);
/// 0 <= p <= 1.
double quantile(std::span<const double> values, double p);
double median(std::span<const double> values);
double mad(std::span<const double> values);

/// Ranks 1..n; equal values share the mean of theirs (midranks).
std::vector<double> midranks(std::span<const double> values);

/// Throws Error unless there are at least `n_min` values and all are finite. `what` begins the message.
void check_sample(std::span<const double> values, const char* what, size_t n_min = 1);

// A sample x_1..x_n >= 0 as sums and a histogram, from which its mean and RMSE follow exactly and its
// quantiles within 0.25 %.
//
//   bin k     values in [2^(k / 139), 2^((k + 1) / 139)): 0.5 % wide. 0 has a bin of its own
//   centre    2^((k + 1/2) / 139): at most 0.25 % from every value of the bin

class LogHistogram {
 public:
  static constexpr int bins_per_octave = 139;
  static constexpr int zero_bin = -1075 * bins_per_octave;  ///< below that of the smallest double

  /// That of a finite value >= 0; throws Error for others.
  static int bin_of(double value);
  static double centre(int bin);

  struct Bin {
    int bin = 0;
    uint64_t n = 0;
    bool operator==(const Bin&) const = default;
  };
  void add(double value) { add(Bin{bin_of(value), 1}); }
  void add(const Bin& bin);

  uint64_t n() const;
  /// Those with values, rising.
  const std::vector<Bin>& bins() const { return bins_; }

  bool operator==(const LogHistogram&) const = default;

 private:
  std::vector<Bin> bins_;
};

struct SampleSums {
  uint64_t n = 0;
  double sum = 0;
  double sum_squares = 0;
  LogHistogram histogram;

  void add(double value);
  bool operator==(const SampleSums&) const = default;
};

}  // namespace sextant
