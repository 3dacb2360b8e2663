#pragma once

// How well a number tells dynamic from static, whatever the threshold: the receiver operating characteristic.

#include <optional>
#include <vector>

namespace sextant {

struct RocPoint {
  double threshold = 0;  ///< called dynamic at scores >= this
  double false_positive_rate = 0;
  double true_positive_rate = 0;
};

struct RocCurve {
  std::vector<RocPoint> points;  ///< by falling threshold, from (0, 0) at infinity to (1, 1)
  /// Probability that a dynamic score is above a static one, ties counting half (Mann & Whitney 1947).
  double area = 0;
  int positives = 0;
  int negatives = 0;
};

struct ScoredDetection {
  double score = 0;
  bool is_dynamic = false;  ///< by truth
};

/// None without both kinds, or with a score that is NaN.
std::optional<RocCurve> roc_curve(std::vector<ScoredDetection> detections);

}  // namespace sextant
