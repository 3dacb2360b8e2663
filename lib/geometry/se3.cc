#include "sextant/geometry/se3.h"

#include <Eigen/SVD>
#include <cmath>

namespace sextant {
namespace {

// Below this angle (rad) the series of the coefficients are more accurate than their closed forms.
constexpr double series_angle_rad = 1e-2;

/// Returns V with translation = V(omega) * rho; Barfoot eq. (7.37).
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& omega) {
  const double angle2 = omega.squaredNorm();
  const double angle = std::sqrt(angle2);
  double a = 0.0;  // (1 - cos) / angle^2
  double b = 0.0;  // (angle - sin) / angle^3
  if (angle < series_angle_rad) {
    a = 0.5 - angle2 / 24.0 + angle2 * angle2 / 720.0;
    b = 1.0 / 6.0 - angle2 / 120.0 + angle2 * angle2 / 5040.0;
  } else {
    a = (1.0 - std::cos(angle)) / angle2;
    b = (angle - std::sin(angle)) / (angle2 * angle);
  }
  const Eigen::Matrix3d w = skew(omega);
  return Eigen::Matrix3d::Identity() + a * w + b * w * w;
}

/// Returns the inverse of left_jacobian(); Barfoot eq. (7.76).
Eigen::Matrix3d left_jacobian_inverse(const Eigen::Vector3d& omega) {
  const double angle2 = omega.squaredNorm();
  const double angle = std::sqrt(angle2);
  double c = 0.0;  // (1 - (angle/2) cot(angle/2)) / angle^2
  if (angle < series_angle_rad) {
    c = 1.0 / 12.0 + angle2 / 720.0 + angle2 * angle2 / 30240.0;
  } else {
    const double half = 0.5 * angle;
    c = (1.0 - half * std::cos(half) / std::sin(half)) / angle2;
  }
  const Eigen::Matrix3d w = skew(omega);
  return Eigen::Matrix3d::Identity() - 0.5 * w + c * w * w;
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& omega) {
  const double angle = omega.norm();
  // sin(angle/2) / angle
  const double k = angle < series_angle_rad
                       ? 0.5 - angle * angle / 48.0 + angle * angle * angle * angle / 3840.0
                       : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q;
  q.w() = std::cos(0.5 * angle);
  q.vec() = k * omega;
  return q.normalized();
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const double sine = q.vec().norm();
  if (sine < 1e-10) return sign * 2.0 * q.vec() / std::abs(q.w());
  return sign * 2.0 * std::atan2(sine, std::abs(q.w())) / sine * q.vec();
}

double rotation_angle_rad(const Eigen::Quaterniond& q) {
  return 2.0 * std::atan2(q.vec().norm(), std::abs(q.w()));
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double det = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * Eigen::Vector3d(1, 1, det).asDiagonal() * svd.matrixV().transpose();
}

SE3 SE3::from_matrix(const Eigen::Matrix<double, 3, 4>& matrix) {
  return {Eigen::Quaterniond(Eigen::Matrix3d(matrix.leftCols<3>())), matrix.col(3)};
}

SE3 SE3::exp(const Vector6d& xi) {
  const Eigen::Vector3d omega = xi.tail<3>();
  return {so3_exp(omega), left_jacobian(omega) * xi.head<3>()};
}

Vector6d SE3::log() const {
  Vector6d xi;
  const Eigen::Vector3d omega = so3_log(rotation_);
  xi << left_jacobian_inverse(omega) * translation_, omega;
  return xi;
}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation_.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

SE3 SE3::inverse() const {
  const Eigen::Quaterniond q = rotation_.conjugate();
  return {q, -(q * translation_)};
}

SE3 SE3::operator*(const SE3& other) const {
  return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
}

Matrix6d SE3::adjoint() const {
  const Eigen::Matrix3d r = rotation_.toRotationMatrix();
  Matrix6d a = Matrix6d::Zero();
  a.topLeftCorner<3, 3>() = r;
  a.topRightCorner<3, 3>() = skew(translation_) * r;
  a.bottomRightCorner<3, 3>() = r;
  return a;
}

}  // namespace sextant
