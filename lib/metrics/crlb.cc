#include "sextant/metrics/crlb.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <vector>

namespace sextant {
namespace {

constexpr size_t most_correlated_points = 600;  // the cost is cubic

/// Returns the inverse of an information matrix; nullopt if a direction of motion is not determined.
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

/// Sum over the points of G_i^T M_i G_i, with M_i the information of point i (3x3, 1/m^2) and
/// G_i = d exp(xi) p_i / d xi = [1, -[p_i]_x].
class TwistInformation {
 public:
  void add(const Eigen::Matrix3d& M, const Eigen::Vector3d& p) {
    Eigen::Matrix3d MS;  // M [p]_x
    for (int i = 0; i < 3; ++i) MS.row(i) = M.row(i).cross(p.transpose());
    translation_ += M;
    mixed_ += MS;
    for (int i = 0; i < 3; ++i) rotation_.col(i) += p.cross(MS.col(i));
  }
  Matrix6d matrix() const {
    Matrix6d information;
    information << translation_, -mixed_, -mixed_.transpose(), -rotation_;
    return information;
  }

 private:
  Eigen::Matrix3d translation_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d mixed_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d rotation_ = Eigen::Matrix3d::Zero();
};

/// Information of both bounds, summed over the points.
class Information {
 public:
  Information(const PinholeCamera& camera, const SE3& T_curr_prev, const MeasurementNoise& noise)
      : camera_(camera),
        R_(T_curr_prev.rotation().toRotationMatrix()),
        t_(T_curr_prev.translation()),
        noise_(noise) {
    flow_variance_ << square(noise.flow_x_px), 0, 0, square(noise.flow_y_px);
  }

  void add(double u, double v, double depth_m, bool has_current_depth) {
    const Eigen::Vector3d moved_ray = R_ * camera_.ray(u, v);
    const Eigen::Vector3d point = depth_m * moved_ray + t_;
    if (!(depth_m > 0) || !(point.z() > 0)) return;  // the point is not observed
    const Eigen::Matrix<double, 2, 3> P = camera_.project_jacobian(point);
    const Eigen::Vector2d j = P * moved_ray;
    const double depth_variance = square(noise_.depth_sigma_m(depth_m));
    const Eigen::Matrix2d S = flow_variance_ + depth_variance * j * j.transpose();
    const Eigen::Matrix2d W = S.inverse();
    previous_depth.add(P.transpose() * (W * P), point);
    if (!has_current_depth) return;

    // Information that the third row adds, given the first two.
    const Eigen::Vector2d cross = moved_ray.z() * depth_variance * j;
    const double variance = square(noise_.depth_sigma_m(point.z())) + square(moved_ray.z()) * depth_variance;
    const Eigen::RowVector2d gain = cross.transpose() * W;
    const Eigen::RowVector3d row = Eigen::RowVector3d::UnitZ() - gain * P;
    current_depth.add(row.transpose() * row / (variance - gain * cross), point);
  }

  TwistInformation previous_depth;
  TwistInformation current_depth;  ///< information that the current depths add

 private:
  static double square(double x) { return x * x; }

  PinholeCamera camera_;
  Eigen::Matrix3d R_;
  Eigen::Vector3d t_;
  MeasurementNoise noise_;
  Eigen::Matrix2d flow_variance_;
};

/// Returns the information of flow and previous depth whose errors are correlated over the image, for all
/// points together; zero if the covariance of the errors is not positive definite.
Matrix6d correlated_information(const PinholeCamera& camera, const Correspondences& exact,
                                const SE3& T_curr_prev, const MeasurementNoise& noise) {
  struct Seen {
    Eigen::Vector2d pixel, by_depth;  ///< j_i times the standard deviation of the depth
    Eigen::Matrix<double, 2, 6> J;
  };
  std::vector<Seen> points;
  for (size_t i = 0; i < exact.size(); ++i) {
    const Eigen::Vector3d ray = T_curr_prev.rotation() * camera.ray(exact.u[i], exact.v[i]);
    const Eigen::Vector3d p = exact.depth[i] * ray + T_curr_prev.translation();
    if (!(exact.depth[i] > 0) || !(p.z() > 0)) continue;
    const Eigen::Matrix<double, 2, 3> P = camera.project_jacobian(p);
    Seen seen{{exact.u[i], exact.v[i]}, noise.depth_sigma_m(exact.depth[i]) * P * ray, {}};
    seen.J.leftCols<3>() = P;
    for (int row = 0; row < 2; ++row) seen.J.row(row).tail<3>() = p.cross(P.row(row).transpose()).transpose();
    points.push_back(seen);
  }
  const auto n = static_cast<Eigen::Index>(points.size());
  const Eigen::Matrix2d flow =
      Eigen::Vector2d(noise.flow_x_px * noise.flow_x_px, noise.flow_y_px * noise.flow_y_px).asDiagonal();
  Eigen::MatrixXd covariance(2 * n, 2 * n), J(2 * n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Seen& a = points[static_cast<size_t>(i)];
    J.middleRows<2>(2 * i) = a.J;
    for (Eigen::Index k = 0; k <= i; ++k) {
      const Seen& b = points[static_cast<size_t>(k)];
      const double rho = i == k ? 1 : noise.correlation.at((a.pixel - b.pixel).norm());
      covariance.block<2, 2>(2 * i, 2 * k) = rho * (flow + a.by_depth * b.by_depth.transpose());
    }
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);  // reads the lower triangle
  if (factor.info() != Eigen::Success) return Matrix6d::Zero();
  const Eigen::MatrixXd whitened = factor.matrixL().solve(J);
  return whitened.transpose() * whitened;
}

}  // namespace

std::optional<MotionBound> motion_bound(const PinholeCamera& camera, const Correspondences& exact,
                                        const SE3& T_curr_prev, const MeasurementNoise& noise) {
  if (!(noise.flow_x_px > 0 && noise.flow_y_px > 0)) return std::nullopt;
  if (!noise.correlation.parts.empty()) {
    if (!noise.gaussian || noise.flow_outlier_share > 0 || exact.size() > most_correlated_points)
      return std::nullopt;
    const auto covariance = inverse(correlated_information(camera, exact, T_curr_prev, noise));
    if (!covariance) return std::nullopt;
    return MotionBound{*covariance, std::nullopt};
  }
  if (!noise.independent_gaussian) return std::nullopt;
  Information information(camera, T_curr_prev, noise);
  bool any_current_depth = false;
  for (size_t i = 0; i < exact.size(); ++i) {
    const bool current_depth = noise.inverse_depth_per_m > 0 && std::isfinite(exact.depth_curr[i]);
    information.add(exact.u[i], exact.v[i], exact.depth[i], current_depth);
    any_current_depth = any_current_depth || current_depth;
  }
  const Matrix6d previous_depth = information.previous_depth.matrix();
  const std::optional<Matrix6d> covariance = inverse(previous_depth);
  if (!covariance) return std::nullopt;
  MotionBound bound{*covariance, std::nullopt};
  if (any_current_depth) bound.both_depths = inverse(previous_depth + information.current_depth.matrix());
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

std::optional<double> nees(const SE3& estimate, const Matrix6d& covariance, const SE3& truth) {
  const Eigen::LLT<Matrix6d> factor(covariance);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Vector6d error = (estimate * truth.inverse()).log();
  const double value = factor.matrixL().solve(error).squaredNorm();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace sextant
