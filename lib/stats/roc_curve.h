#pragma once

// Receiver operating characteristic: how well a score separates dynamic from static objects over all
// thresholds.

#include <optional>
#include <vector>

namespace sextant {

struct RocPoint {
  double threshold = 0;  ///< scores >= threshold are classified as dynamic
  double false_positive_rate = 0;
  double true_positive_rate = 0;
};

struct RocCurve {
  std::vector<RocPoint> points;  ///< by descending threshold, from (0, 0) at infinity to (1, 1)
  /// Probability that a dynamic score is above a static one, ties counting half (Mann & Whitney 1947).
  double area = 0;
  int positives = 0;
  int negatives = 0;
};

struct ScoredDetection {
  double score = 0;
  bool is_dynamic = false;  ///< ground truth
};

/// Returns the curve; nullopt unless both classes occur and no score is NaN.
std::optional<RocCurve> roc_curve(std::vector<ScoredDetection> detections);

}  // namespace sextant
