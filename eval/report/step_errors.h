#pragma once

// What of a camera's step errors is the same in every pair, or grows along the sequence: no noise of
// measurements, but calibration, scale, or the truth's own heading.
//
//   e_k = estimated minus true translation of pair k (T_prev_curr, axes of the previous camera, m)
//   mean, scatter: mean and standard deviation (n - 1) of e by axis
//   drift: slope of the least-squares line through e_x (to the right) over the frame number, m a frame

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace sextant {

struct StepErrors {
  Eigen::Vector3d mean_m{0, 0, 0}, scatter_m{0, 0, 0};
  double drift_m = 0;
  int n = 0;

  /// "mean 0.0566 m (right -0.0400, down 0.0400, ahead 0.0000), scatter ... m; drift to the right 0.45 mm a frame"
  std::string text() const;
};

/// Empty for fewer than two pairs. Pairs of one frame only have no drift, 0.
std::optional<StepErrors> step_errors(const std::vector<int>& frames, const std::vector<Eigen::Vector3d>& errors_m);

}  // namespace sextant
