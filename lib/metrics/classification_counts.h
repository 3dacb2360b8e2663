#pragma once

// Dynamic/static classification against truth (paper Table I): positive = dynamic.

#include <optional>

namespace sextant {

struct ClassificationCounts {
  int true_positive = 0;   ///< dynamic, found dynamic
  int false_positive = 0;  ///< static, found dynamic
  int false_negative = 0;  ///< dynamic, found static
  int true_negative = 0;   ///< static, found static

  void add(bool found_dynamic, bool is_dynamic) {
    ++(found_dynamic ? is_dynamic ? true_positive : false_positive
       : is_dynamic  ? false_negative
                     : true_negative);
  }
  int total() const { return true_positive + false_positive + false_negative + true_negative; }
  /// Empty when the denominator is zero: never a silent 0.
  std::optional<double> precision() const { return share(true_positive, true_positive + false_positive); }
  std::optional<double> recall() const { return share(true_positive, true_positive + false_negative); }

 private:
  static std::optional<double> share(int part, int all) {
    return all == 0 ? std::nullopt : std::optional(static_cast<double>(part) / all);
  }
};

/// Where a data set has no flag: dynamic if the true speed exceeds this (m/s). A label box standing still
/// moves by up to about 0.05 m a frame through annotation and pose jitter, 0.5 m/s at 10 Hz.
constexpr double min_true_speed_mps = 1.0;

}  // namespace sextant
