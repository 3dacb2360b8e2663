#pragma once

// Rigid motion SE(3).
//
//   T_a_b maps b-coordinates to a-coordinates:  p_a = T_a_b * p_b;  T_a_c = T_a_b * T_b_c.
//   Twist xi = [rho; omega] (translation first, metres and radians); T = exp(xi), xi = log(T).
//   Perturbation is on the LEFT: T <- exp(xi) * T.  Adjoint: exp(Ad(T) xi) * T = T * exp(xi).
//
// Reference: Barfoot, State Estimation for Robotics (2017), ch. 7.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace sextant {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Returns the matrix [w]_x with [w]_x v = w x v.
Eigen::Matrix3d skew(const Eigen::Vector3d& w);

/// Exponential and logarithm of SO(3): from the rotation vector (axis * angle, rad) to the unit quaternion,
/// and back to the rotation vector of length <= pi.
Eigen::Quaterniond so3_exp(const Eigen::Vector3d& omega);
Eigen::Vector3d so3_log(const Eigen::Quaterniond& q);

/// Returns the angle of a rotation in [0, pi] rad as 2 atan2(|q_v|, |q_w|), which is accurate near 0, unlike
/// acos(trace).
double rotation_angle_rad(const Eigen::Quaterniond& q);

/// Returns the rotation R that is nearest to a matrix in the Frobenius norm, which maximises trace(R' m).
/// Source: Umeyama, Least-squares estimation of transformation parameters, PAMI 1991, lemma.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

class SE3 {
 public:
  SE3() = default;
  SE3(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  /// Builds a motion from the upper 3x4 block of its matrix; the rotation is projected onto SO(3) through a
  /// quaternion.
  static SE3 from_matrix(const Eigen::Matrix<double, 3, 4>& matrix);
  /// Restores a motion bit for bit from its rotation() and translation(); the quaternion is not normalised
  /// again.
  static SE3 from_parts(const Eigen::Quaterniond& unit_rotation, const Eigen::Vector3d& translation) {
    SE3 T;
    T.rotation_ = unit_rotation;
    T.translation_ = translation;
    return T;
  }

  static SE3 exp(const Vector6d& xi);
  Vector6d log() const;

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix4d matrix() const;

  SE3 inverse() const;
  SE3 operator*(const SE3& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation_ * point + translation_; }
  Matrix6d adjoint() const;

  bool is_finite() const { return rotation_.coeffs().allFinite() && translation_.allFinite(); }

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

}  // namespace sextant
