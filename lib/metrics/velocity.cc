#include "sextant/metrics/velocity.h"

#include <cmath>

#include "sextant/estimator/pipeline.h"

namespace sextant {

double velocity_kmh(const SE3& H, const Eigen::Vector3d& centroid, double dt_s) {
  return speed_mps(H, centroid, dt_s) * kmh_per_mps;
}

double velocity_error_kmh(double estimate_kmh, double truth_kmh) {
  return std::abs(estimate_kmh - truth_kmh);
}

}  // namespace sextant
