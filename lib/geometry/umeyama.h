#pragma once

// The similarity y = s R x + t nearest to pairs of points in the sense of least squares:
//
//   Sigma = 1/n sum (y_i - y_mean)(x_i - x_mean)' = U D V',  S = diag(1, 1, det(U) det(V))
//   R = U S V',  s = trace(D S) / var(x),  t = y_mean - s R x_mean
//
// and the same with s = 1 and a rotation about one known axis u alone,
// for two paths that both know where up is:
//
//   R = rotation about u by atan2(u . sum dx x dy, sum dx . dy - (u . dx)(u . dy))
//
// Source: S. Umeyama, Least-squares estimation of transformation parameters between two point patterns,
// IEEE PAMI 13(4), 1991, eq. 34-43.

#include <Eigen/Core>
#include <optional>
#include <span>

namespace sextant {

struct Similarity {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();
  double scale = 1;

  /// [s R | t; 0 0 0 1]
  Eigen::Matrix4d matrix() const;
};

struct UmeyamaResult {
  Similarity y_from_x;
  /// Second over first singular value of Sigma; near 0 the points lie on a line, and the rotation about that
  /// line is arbitrary.
  double flatness = 0;
};

/// Empty when the points do not determine a rotation: fewer than two singular values of Sigma above 2.2e-16
/// m^2 (one of the sets stands still, or both lie on an axis). With `with_scale` off s = 1.
std::optional<UmeyamaResult> umeyama(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y,
                                     bool with_scale);

/// About the unit vector `axis`. Empty when the points do not determine the angle: one of the sets has no
/// extent across the axis (below 2.2e-16 m^2).
std::optional<Similarity> rotation_about(const Eigen::Vector3d& axis, std::span<const Eigen::Vector3d> x,
                                         std::span<const Eigen::Vector3d> y);

}  // namespace sextant
