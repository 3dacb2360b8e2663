#pragma once

// Components of a camera's step errors that are equal in every pair, or grow along the sequence. They are not
// caused by measurement noise but by calibration, scale, or the heading of the truth.
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

/// Computes the components; empty for fewer than two pairs. If all pairs have the same frame, the drift is 0.
std::optional<StepErrors> step_errors(const std::vector<int>& frames,
                                      const std::vector<Eigen::Vector3d>& errors_m);

}  // namespace sextant
