#include "sextant/eval/view/uncertainty.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "sextant/eval/records/record.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/crlb.h"
#include "sextant/stats/distributions.h"

namespace sextant {
namespace {

constexpr double deg_per_rad = 180.0 / std::numbers::pi;
constexpr double none = std::numeric_limits<double>::quiet_NaN();

bool has_covariance(const BodyResult& body) {
  return body.status == Status::ok && body.estimate.covariance.allFinite() && body.estimate.covariance.trace() > 0;
}

/// d(exp(e) p) / d e.
Eigen::Matrix<double, 3, 6> point_jacobian(const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -skew(p);
  return J;
}

TopViewCovariance from_above(const Eigen::Matrix3d& C) { return {C(0, 0), C(0, 2), C(2, 2)}; }

double speed_band_kmh(const BodyResult& body, const FrameResult& frame) {
  if (!has_covariance(frame.ego)) return none;
  const SE3& X = body.estimate.T_curr_prev;
  const SE3& X0 = frame.ego.estimate.T_curr_prev;
  const Eigen::Vector3d moved = object_motion_prev(X0, X) * body.centroid_m - body.centroid_m;
  if (moved.norm() == 0) return none;
  // H c = X0^-1 X c: both motions turn and shift the same point of the current camera, in opposite directions.
  const Eigen::RowVector<double, 6> along =
      (X0.rotation() * moved.normalized()).transpose() * point_jacobian(X * body.centroid_m);
  const double variance = along * (body.estimate.covariance + frame.ego.estimate.covariance) * along.transpose();
  return normal_quantile(0.5 + band_probability / 2) * std::sqrt(variance) / frame.dt_s * kmh_per_mps;
}

}  // namespace

double length_quantile(const Eigen::Matrix3d& covariance, double p) {
  const double mean_square = covariance.trace();
  const double half_variance = covariance.squaredNorm();  // trace(C C)
  if (!(mean_square > 0)) return 0;
  const double dof = mean_square * mean_square / half_variance;
  return std::sqrt(half_variance / mean_square * chi_square_quantile(p, dof));
}

ErrorBand error_band(const BodyResult& body, const FrameResult& frame) {
  if (!has_covariance(body)) return {none, none, none};
  const bool is_camera = body.instance == 0;
  const Matrix6d C = is_camera ? body.estimate.covariance
                               : transported(body.estimate.covariance, body.estimate.T_curr_prev.inverse());
  return {length_quantile(C.topLeftCorner<3, 3>(), band_probability),
          length_quantile(C.bottomRightCorner<3, 3>(), band_probability) * deg_per_rad,
          is_camera ? none : speed_band_kmh(body, frame)};
}

std::map<std::string, TopViewCovariance> PositionCovariances::add(const FrameResult& frame, const SE3& T_world_curr,
                                                                  const std::map<int, Eigen::Vector3d>& objects_m) {
  std::map<std::string, TopViewCovariance> out;
  if (!has_covariance(frame.ego)) return out;
  const auto in_world = [&](const Matrix6d& C, const Eigen::Vector3d& p) -> Eigen::Matrix3d {
    const auto J = point_jacobian(p);
    return J * C * J.transpose();
  };
  const Matrix6d ego_step = transported(frame.ego.estimate.covariance, T_world_curr);
  camera_ += ego_step;
  out["ego"] = from_above(in_world(camera_, T_world_curr.translation()));
  for (const BodyResult& body : frame.objects) {
    const auto position = objects_m.find(body.instance);
    if (!has_covariance(body) || position == objects_m.end()) continue;
    Object& object = objects_[body.instance];
    if (object.last != frame.prev) object.covariance.setZero();
    object.last = frame.curr;
    object.covariance += in_world(transported(body.estimate.covariance, T_world_curr) + ego_step, position->second);
    out[object_body(body.instance)] = from_above(object.covariance);
  }
  return out;
}

}  // namespace sextant
