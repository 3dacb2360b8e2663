#pragma once

// Descriptive statistics of a sample x_1..x_n. The functions below throw Error for an empty sample, for
// values that are not finite (the caller leaves out and counts missing values) and for n that is too small:
//
//   mean      sum x / n                          rmse    sqrt(sum x^2 / n)
//   std_dev   sqrt(sum (x - mean)^2 / (n - 1)), n >= 2
//   quantile  type 7 of Hyndman and Fan (base/quantile.h)
//   median    quantile 1/2
//   mad       median |x - median|; 1.4826 mad estimates sigma of a normal distribution

#include <cstdint>
#include <span>
#include <vector>

#include "sextant/base/quantile.h"

namespace sextant {

double mean(std::span<const double> values);
double rmse(std::span<const double> values);
double std_dev(std::span<const double> values);
/// Returns the quantile p; throws Error unless 0 <= p <= 1.
double quantile(std::span<const double> values, double p);
double median(std::span<const double> values);
double mad(std::span<const double> values);

/// Returns the rank of each value, from 1 to n; equal values get the mean of their ranks (midranks). Does not
/// check the values.
std::vector<double> midranks(std::span<const double> values);

/// Throws Error unless there are at least `n_min` values and all are finite; `what` begins the message.
void check_sample(std::span<const double> values, const char* what, size_t n_min = 1);

// A sample of values >= 0 as moments and a histogram, which give its mean and RMSE exactly and its quantiles
// with a relative error of at most 0.25 %.
//
//   bin k     values in [2^(k / 139), 2^((k + 1) / 139)): 0.5 % wide. 0 has a bin of its own
//   centre    2^((k + 1/2) / 139): at most 0.25 % from every value of the bin

class LogHistogram {
 public:
  static constexpr int bins_per_octave = 139;
  static constexpr int zero_bin = -1075 * bins_per_octave;  ///< below the bin of the smallest double

  /// Returns the bin of a finite value >= 0; throws Error for other values.
  static int bin_of(double value);
  /// Returns the centre of a bin; 0 for zero_bin.
  static double centre(int bin);

  struct Bin {
    int bin = 0;
    uint64_t n = 0;
    bool operator==(const Bin&) const = default;
  };
  void add(double value) { add(Bin{bin_of(value), 1}); }
  void add(const Bin& bin);

  uint64_t n() const;
  /// Non-empty bins, ascending.
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
