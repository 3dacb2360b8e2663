#include "sextant/metrics/crlb.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

namespace sextant {
namespace {

/// The inverse of an information matrix; none where a direction of motion is not determined.
std::optional<Matrix6d> inverse(const Matrix6d& information) {
  constexpr double least_eigenvalue = 1e-12;
  const Vector6d scale = information.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const Matrix6d unit = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(unit);
  if (!(eigen.eigenvalues()[0] > least_eigenvalue)) return std::nullopt;
  const Matrix6d unit_inverse = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                                eigen.eigenvectors().transpose();
  return scale.asDiagonal() * unit_inverse * scale.asDiagonal();
}

/// I of both kinds, summed point by point.
class Information {
 public:
  Information(const PinholeCamera& camera, const SE3& T_curr_prev, const MeasurementNoise& noise)
      : camera_(camera), R_(T_curr_prev.rotation()), t_(T_curr_prev.translation()), noise_(noise) {
    flow_variance_ << noise.flow_x_px * noise.flow_x_px, 0, 0, noise.flow_y_px * noise.flow_y_px;
  }

  void add(double u, double v, double depth_m, bool has_current_depth) {
    const Eigen::Vector3d moved_ray = R_ * camera_.ray(u, v);
    const Eigen::Vector3d point = depth_m * moved_ray + t_;
    if (!(depth_m > 0) || !(point.z() > 0)) return;  // nothing is seen of it
    const Eigen::Matrix<double, 2, 6> J = camera_.motion_jacobian(point);
    const Eigen::Vector2d j = camera_.project_jacobian(point) * moved_ray;
    const double depth_variance = square(noise_.depth_sigma_m(depth_m));
    const Eigen::Matrix2d S = flow_variance_ + depth_variance * j * j.transpose();
    const Eigen::Matrix2d W = S.inverse();
    previous_depth.noalias() += J.transpose() * (W * J);
    if (!has_current_depth) return;

    // What the third row adds, given the first two.
    Eigen::Matrix<double, 1, 6> row;
    row << 0, 0, 1, point.y(), -point.x(), 0;
    const Eigen::Vector2d cross = moved_ray.z() * depth_variance * j;
    const double variance = square(noise_.depth_sigma_m(point.z())) + square(moved_ray.z()) * depth_variance;
    const Eigen::RowVector2d gain = cross.transpose() * W;
    row -= gain * J;
    current_depth.noalias() += row.transpose() * row / (variance - gain * cross);
  }

  Matrix6d previous_depth = Matrix6d::Zero();
  Matrix6d current_depth = Matrix6d::Zero();

 private:
  static double square(double x) { return x * x; }

  PinholeCamera camera_;
  Eigen::Matrix3d R_;
  Eigen::Vector3d t_;
  MeasurementNoise noise_;
  Eigen::Matrix2d flow_variance_;
};

}  // namespace

std::optional<MotionBound> motion_bound(const PinholeCamera& camera, const Correspondences& exact,
                                        const SE3& T_curr_prev, const MeasurementNoise& noise) {
  if (!noise.independent_gaussian || !(noise.flow_x_px > 0 && noise.flow_y_px > 0)) return std::nullopt;
  Information information(camera, T_curr_prev, noise);
  bool any_current_depth = false;
  for (size_t i = 0; i < exact.size(); ++i) {
    const bool current_depth = noise.inverse_depth_per_m > 0 && std::isfinite(exact.depth_curr[i]);
    information.add(exact.u[i], exact.v[i], exact.depth[i], current_depth);
    any_current_depth = any_current_depth || current_depth;
  }
  const std::optional<Matrix6d> covariance = inverse(information.previous_depth);
  if (!covariance) return std::nullopt;
  MotionBound bound{*covariance, std::nullopt};
  if (any_current_depth) bound.both_depths = inverse(information.previous_depth + information.current_depth);
  return bound;
}

Matrix6d transported(const Matrix6d& covariance, const SE3& T) {
  const Matrix6d adjoint = T.adjoint();
  return adjoint * covariance * adjoint.transpose();
}

PoseChangeError rms_error(const Matrix6d& covariance) {
  return {std::sqrt(covariance.topLeftCorner<3, 3>().trace()),
          std::sqrt(covariance.bottomRightCorner<3, 3>().trace()) * 180.0 / std::numbers::pi};
}

}  // namespace sextant
