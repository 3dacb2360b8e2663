#include "sextant/stats/roc_curve.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace sextant {

std::optional<RocCurve> roc_curve(std::vector<ScoredDetection> detections) {
  RocCurve out;
  for (const ScoredDetection& detection : detections) {
    if (std::isnan(detection.score)) return std::nullopt;
    ++(detection.is_dynamic ? out.positives : out.negatives);
  }
  if (out.positives == 0 || out.negatives == 0) return std::nullopt;
  std::ranges::sort(detections, std::greater(), &ScoredDetection::score);
  out.points.push_back({std::numeric_limits<double>::infinity(), 0, 0});
  int positives = 0, negatives = 0;
  for (size_t i = 0; i < detections.size();) {
    const double score = detections[i].score;
    for (; i < detections.size() && detections[i].score == score; ++i)
      ++(detections[i].is_dynamic ? positives : negatives);
    const RocPoint& before = out.points.back();
    const RocPoint at{score, static_cast<double>(negatives) / out.negatives,
                      static_cast<double>(positives) / out.positives};
    // Ties form a slope, integrated by trapezoids.
    out.area += (at.false_positive_rate - before.false_positive_rate) * 0.5 *
                (at.true_positive_rate + before.true_positive_rate);
    out.points.push_back(at);
  }
  return out;
}

}  // namespace sextant
