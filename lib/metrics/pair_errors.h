#pragma once

// Pose change error of one step (paper sec. V):  E = Xhat^-1 X,  E_t = |trans(E)| (m),
// E_R = angle(E) (deg), the angle as 2 atan2(|q_v|, |q_w|) in double.
//
// Choice of the motion X (geometry/object_motion.h). `camera`: T_curr_prev of the object; for the ego motion
// T_prev_curr. `world` (published code): H_world, with the estimate in the estimated world frame, so that it
// includes the camera's drift and depends on the distance to the world's origin. `body` (VDO-SLAM, DynOSAM
// RME): H_body.

#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"

namespace sextant {

struct PoseChangeError {
  double Et_m = 0;
  double ER_deg = 0;
};

inline PoseChangeError pose_change_error(const SE3& estimate, const SE3& truth) {
  const SE3 error = estimate.inverse() * truth;
  return {error.translation().norm(), rotation_angle_rad(error.rotation()) * 180.0 / std::numbers::pi};
}

/// Returns E_v = |v_hat - v| of one object step, km/h; geometry/object_motion.h defines the speed v. Records
/// have two true speeds (docs/metrics.md):
///   v_gt_kmh          of the true H, at the same centroid as the estimate; E_v is Ev_kmh
///   v_gt_origin_kmh   displacement of the origin of the true label box (published code); Ev_origin_kmh
inline double velocity_error_kmh(double estimate_kmh, double truth_kmh) {
  return std::abs(estimate_kmh - truth_kmh);
}

// Optical flow end-point error over points (px): mean of |flow - truth|, and per axis the mean absolute
// error (paper Table II). Points whose flow or truth is not finite are left out and not counted.

struct FlowError {
  double epe_px = 0;  ///< NaN when n == 0
  double x_px = 0;
  double y_px = 0;
  int n = 0;
};

inline FlowError flow_error(std::span<const double> u, std::span<const double> v,
                            std::span<const double> true_u, std::span<const double> true_v) {
  SEXTANT_CHECK(u.size() == v.size() && u.size() == true_u.size() && u.size() == true_v.size());
  FlowError sum;
  for (size_t i = 0; i < u.size(); ++i) {
    const double du = u[i] - true_u[i];
    const double dv = v[i] - true_v[i];
    if (!std::isfinite(du) || !std::isfinite(dv)) continue;
    sum.epe_px += std::hypot(du, dv);
    sum.x_px += std::abs(du);
    sum.y_px += std::abs(dv);
    ++sum.n;
  }
  const double n = sum.n > 0 ? sum.n : NAN;
  return {sum.epe_px / n, sum.x_px / n, sum.y_px / n, sum.n};
}

/// Flow that a rigid motion X induces at points of known depth: project(X * backproject(p, d)) - p. For data
/// sets with true motion but no true flow this is the `induced` truth, which contains the errors of the
/// measured depth. NaN for points that X moves behind the camera.
struct PointFlow {
  std::vector<double> u;
  std::vector<double> v;
};
inline PointFlow induced_flow(const PinholeCamera& camera, const SE3& T_curr_prev,
                              const Correspondences& points) {
  PointFlow flow;
  flow.u.reserve(points.size());
  flow.v.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = T_curr_prev * camera.backproject(points.u[i], points.v[i], points.depth[i]);
    const Eigen::Vector2d uv =
        p.z() > 0 ? camera.project(p) : Eigen::Vector2d(Eigen::Vector2d::Constant(NAN));
    flow.u.push_back(uv.x() - points.u[i]);
    flow.v.push_back(uv.y() - points.v[i]);
  }
  return flow;
}

// Dynamic/static classification against truth (paper Table I); positive = dynamic.

struct ClassificationCounts {
  int true_positive = 0;   ///< dynamic, classified as dynamic
  int false_positive = 0;  ///< static, classified as dynamic
  int false_negative = 0;  ///< dynamic, classified as static
  int true_negative = 0;   ///< static, classified as static

  void add(bool found_dynamic, bool is_dynamic) {
    ++(found_dynamic ? is_dynamic ? true_positive : false_positive
       : is_dynamic  ? false_negative
                     : true_negative);
  }
  int total() const { return true_positive + false_positive + false_negative + true_negative; }
  /// nullopt if the denominator is 0, never a silent 0.
  std::optional<double> precision() const { return share(true_positive, true_positive + false_positive); }
  std::optional<double> recall() const { return share(true_positive, true_positive + false_negative); }

 private:
  static std::optional<double> share(int part, int all) {
    return all == 0 ? std::nullopt : std::optional(static_cast<double>(part) / all);
  }
};

}  // namespace sextant
