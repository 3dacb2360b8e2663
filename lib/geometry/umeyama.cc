#include "sextant/geometry/umeyama.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"

namespace sextant {
namespace {

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

}  // namespace

Eigen::Matrix4d Similarity::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = scale * rotation;
  m.topRightCorner<3, 1>() = translation_m;
  return m;
}

std::optional<UmeyamaResult> umeyama(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y,
                                     bool with_scale) {
  SEXTANT_CHECK(x.size() == y.size());
  if (x.empty()) return std::nullopt;
  const auto n = static_cast<double>(x.size());
  const Eigen::Vector3d mean_x = mean_of(x);
  const Eigen::Vector3d mean_y = mean_of(y);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double variance_x = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3d dx = x[i] - mean_x;
    covariance += (y[i] - mean_y) * dx.transpose();
    variance_x += dx.squaredNorm();
  }
  covariance /= n;
  variance_x /= n;

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& d = svd.singularValues();
  if (!(d[1] > std::numeric_limits<double>::epsilon())) return std::nullopt;
  Eigen::Vector3d s = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) s[2] = -1;

  UmeyamaResult result;
  Similarity& out = result.y_from_x;
  out.rotation = svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose();
  if (with_scale) out.scale = d.dot(s) / variance_x;
  out.translation_m = mean_y - out.scale * (out.rotation * mean_x);
  result.flatness = d[1] / d[0];
  return result;
}

std::optional<Similarity> rotation_about(const Eigen::Vector3d& axis, std::span<const Eigen::Vector3d> x,
                                         std::span<const Eigen::Vector3d> y) {
  SEXTANT_CHECK(x.size() == y.size());
  if (x.empty()) return std::nullopt;
  const Eigen::Vector3d mean_x = mean_of(x), mean_y = mean_of(y);
  double sine = 0, cosine = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3d dx = x[i] - mean_x, dy = y[i] - mean_y;
    sine += axis.dot(dx.cross(dy));
    cosine += dx.dot(dy) - axis.dot(dx) * axis.dot(dy);
  }
  const double extent = std::hypot(sine, cosine) / static_cast<double>(x.size());
  if (!(extent > std::numeric_limits<double>::epsilon())) return std::nullopt;
  Similarity out;
  out.rotation = Eigen::AngleAxisd(std::atan2(sine, cosine), axis).toRotationMatrix();
  out.translation_m = mean_y - out.rotation * mean_x;
  return out;
}

}  // namespace sextant
