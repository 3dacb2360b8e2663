#include "sextant/estimator/classification.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "sextant/base/quantile.h"

namespace sextant {
namespace {

/// Returns the minimum over |e| <= radius of (d - e)^T S^-1 (d - e). `variances`: eigenvalues of S; `d`: in
/// the basis of the eigenvectors of S.
double distance2_from_ball(const Eigen::Vector3d& d, const Eigen::Vector3d& variances, double radius) {
  if (d.norm() <= radius) return 0;
  // e_i = d_i / (1 + m s_i) with the Lagrange multiplier m >= 0 for which |e| = radius; |e| decreases with m.
  const auto nearest = [&](double m) -> Eigen::Vector3d { return d.array() / (1 + m * variances.array()); };
  double low = 0, high = 1 / variances.minCoeff();
  while (nearest(high).norm() > radius && high < 1e300) high *= 4;
  for (int k = 0; k < 100; ++k) {
    const double middle = 0.5 * (low + high);
    (nearest(middle).norm() > radius ? low : high) = middle;
  }
  const Eigen::Vector3d rest = d - nearest(high);
  return (rest.array().square() / variances.array()).sum();
}

}  // namespace

void ClassificationOptions::check() const {
  check_option(min_speed_mps > 0, "min_speed_mps", min_speed_mps, "> 0");
  check_option(min_moving_share >= 0 && min_moving_share < 1, "min_moving_share", min_moving_share,
               "in [0, 1)");
  check_option(smallest_speed_mps > 0, "smallest_speed_mps", smallest_speed_mps, "> 0");
  check_option(false_alarm_rate > 0 && false_alarm_rate < 1, "false_alarm_rate", false_alarm_rate,
               "in (0, 1)");
}

MotionClass classify_motion(const Problem& object, const SE3& T_curr_prev_background, double dt_s,
                            const ClassificationOptions& options) {
  const SE3 T_prev_curr = T_curr_prev_background.inverse();
  const PinholeCamera& camera = object.camera.left;
  const Correspondences& points = object.points;
  const double threshold_m = options.min_speed_mps * dt_s;
  int n_moving = 0;
  MotionClass result;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points.depth_curr[i])) continue;
    const Eigen::Vector3d m_prev = camera.backproject(points.u[i], points.v[i], points.depth[i]);
    const Eigen::Vector3d m_curr = camera.backproject(points.u[i] + points.flow_u[i],
                                                      points.v[i] + points.flow_v[i], points.depth_curr[i]);
    const Eigen::Vector3d f = m_prev - T_prev_curr * m_curr;
    const double length_m = options.use_vertical ? f.norm() : std::sqrt(f.x() * f.x() + f.z() * f.z());
    ++result.n_points;
    n_moving += length_m > threshold_m ? 1 : 0;
  }
  result.moving_share = result.n_points > 0 ? static_cast<double>(n_moving) / result.n_points : NAN;
  result.is_dynamic = result.n_points == 0 || result.moving_share > options.min_moving_share;
  return result;
}

std::optional<MotionLikelihood> test_motion(const MotionEstimate& body, const MotionEstimate& background,
                                            const Eigen::Vector3d& centre_m, double dt_s,
                                            const ClassificationOptions& options) {
  const SE3 relative = body.T_curr_prev * background.T_curr_prev.inverse();
  const Eigen::Vector3d at = background.T_curr_prev * centre_m;
  const Matrix6d adjoint = relative.adjoint();
  // Maps the twist to the displacement of the centre and the rotation.
  Matrix6d to_centre = Matrix6d::Identity();
  to_centre.topRightCorner<3, 3>() = -skew(at);
  const Matrix6d covariance = to_centre *
                              (body.covariance + adjoint * background.covariance * adjoint.transpose()) *
                              to_centre.transpose();
  if (!covariance.allFinite()) return std::nullopt;
  const Eigen::LLT<Matrix6d> factor(covariance);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Matrix6d information = factor.solve(Matrix6d::Identity());
  const Eigen::Vector3d turn = relative.log().tail<3>();
  const Eigen::LLT<Eigen::Matrix3d> of_centre(information.topLeftCorner<3, 3>());
  if (of_centre.info() != Eigen::Success) return std::nullopt;
  const Eigen::Vector3d d = relative * at - at + of_centre.solve(information.topRightCorner<3, 3>() * turn);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(of_centre.solve(Eigen::Matrix3d::Identity()));
  if (!(eigen.eigenvalues().minCoeff() > 0) || !d.allFinite()) return std::nullopt;
  const double radius = options.smallest_speed_mps * dt_s;
  const double threshold2 = approximate_chi_square_quantile(1 - options.false_alarm_rate, 3);
  MotionLikelihood out;
  const double distance2 =
      distance2_from_ball(eigen.eigenvectors().transpose() * d, eigen.eigenvalues(), radius);
  out.statistic = std::sqrt(distance2);
  out.detectable_mps = (radius + std::sqrt(threshold2 * eigen.eigenvalues().maxCoeff())) / dt_s;
  out.is_dynamic = distance2 > threshold2;
  return out;
}

}  // namespace sextant
