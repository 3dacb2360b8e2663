#include "sextant/metrics/nees.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace sextant {

std::optional<double> nees(const SE3& estimate, const Matrix6d& covariance, const SE3& truth) {
  const Eigen::LLT<Matrix6d> factor(covariance);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Vector6d error = (estimate * truth.inverse()).log();
  const double value = factor.matrixL().solve(error).squaredNorm();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace sextant
