#include "sextant/estimator/errors_in_variables.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

using Rows = Eigen::Matrix<double, 3, 6>;  // of u', v', s' = 1 / z'

/// A point in the current frame: x, y = u', v' normalised, c = 1 / z'; and their derivatives by s.
struct MovedPoint {
  double x, y, c;
  double dx, dy, dc;
};

Rows jacobian(const PinholeCamera& k, const MovedPoint& p) {
  const double x = p.x, y = p.y, c = p.c;
  Rows J;
  J << k.fx * c, 0, -k.fx * x * c, -k.fx * x * y, k.fx * (1 + x * x), -k.fx * y,  //
      0, k.fy * c, -k.fy * y * c, -k.fy * (1 + y * y), k.fy * x * y, k.fy * x,    //
      0, 0, -c * c, -c * y, c * x, 0;
  return J;
}

/// d jacobian / d s.
Rows jacobian_slope(const PinholeCamera& k, const MovedPoint& p) {
  const double xc = p.dx * p.c + p.x * p.dc;
  const double yc = p.dy * p.c + p.y * p.dc;
  const double xy = p.dx * p.y + p.x * p.dy;
  Rows J;
  J << k.fx * p.dc, 0, -k.fx * xc, -k.fx * xy, 2 * k.fx * p.x * p.dx, -k.fx * p.dy,  //
      0, k.fy * p.dc, -k.fy * yc, -2 * k.fy * p.y * p.dy, k.fy * xy, k.fy * p.dx,    //
      0, 0, -2 * p.c * p.dc, -yc, xc, 0;
  return J;
}

/// H^-1/2 (H - B) H^-1/2 by its eigenvectors: twist = directions * coordinates, H = unit matrix there.
struct Directions {
  Vector6d lambda = Vector6d::Zero();
  Matrix6d directions = Matrix6d::Zero();
  bool determined = false;
};

Directions directions_of(const DepthInformation& information) {
  Directions out;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> eigen(information.total - information.errors,
                                                                 information.total);
  if (eigen.info() != Eigen::Success || !eigen.eigenvectors().allFinite()) return out;
  out.lambda = eigen.eigenvalues();
  out.directions = eigen.eigenvectors();  // v_i^T H v_j = delta_ij
  out.determined = true;
  return out;
}

}  // namespace

DepthInformation depth_information(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                                   const RobustKernel& kernel) {
  constexpr size_t sample_size = 1000;
  PointEvaluation at;
  evaluate_points(data, T_curr_prev, levels, at);
  const PinholeCamera& camera = data.camera().left;
  const double info_u = 1 / (levels.sigma_flow_u_px * levels.sigma_flow_u_px);
  const double info_v = 1 / (levels.sigma_flow_v_px * levels.sigma_flow_v_px);
  const size_t used = data.n_used();
  const size_t stride = std::max<size_t>(used / sample_size, 1);
  DepthInformation out;
  size_t seen = 0;
  size_t sampled = 0;
  for (size_t i = 0; i < data.size(); ++i) {
    if (!data.used(i) || seen++ % stride != 0 || !std::isfinite(at.q[i])) continue;
    ++sampled;
    const PointDepths depths = data.depths(i, levels);
    const double s = at.inverse_depth[i];
    const double c = at.inverse_depth_curr[i];
    const double w = s / c;
    const MovedPoint point{at.x_curr[i],
                           at.y_curr[i],
                           c,
                           at.slope_u[i] / camera.fx,
                           at.slope_v[i] / camera.fy,
                           (w - s * T_curr_prev.translation().z()) / (w * w)};
    const Eigen::Vector3d info(info_u, info_v, depths.weight_curr * depths.weight_curr);
    const Eigen::Vector3d j(at.slope_u[i], at.slope_v[i], point.dc);
    const Eigen::Vector3d b = info.cwiseProduct(j);
    const double depth_info = b.dot(j) + depths.weight * depths.weight;
    Eigen::Matrix3d weight = info.asDiagonal();
    if (depths.weight > 0) weight -= b * b.transpose() / depth_info;
    weight *= kernel.weight(at.q[i]);
    const Rows J = jacobian(camera, point);
    out.total += J.transpose() * (weight * J);
    if (!(depths.weight > 0)) continue;
    const Rows slope = jacobian_slope(camera, point);
    out.errors += slope.transpose() * (weight * slope) / depth_info;
  }
  if (sampled == 0) return out;
  const double scale = static_cast<double>(used) / static_cast<double>(sampled);
  out.total *= scale;
  out.errors *= scale;
  return out;
}

std::optional<SE3> motion_of_measured_depths(FlowDepthData& data, const SE3& start, NoiseLevels levels,
                                             RobustKernel kernel) {
  constexpr int max_steps = 10;
  constexpr double tolerance = 1e-7;
  levels.as_measured = true;
  levels.delta_d_curr_px = 0;
  kernel.majorize = true;
  SE3 X = start;
  for (int k = 0; k < max_steps; ++k) {
    const NormalEquations at = accumulate(data, X, levels, kernel);
    const Vector6d step = at.hessian.ldlt().solve(-at.gradient);
    if (!std::isfinite(at.cost) || !step.allFinite()) return std::nullopt;
    X = SE3::exp(step) * X;
    if (step.cwiseAbs().maxCoeff() < tolerance) break;
  }
  return X.is_finite() ? std::optional(X) : std::nullopt;
}

MotionPrior weak_directions(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                            const RobustKernel& kernel) {
  constexpr double strong = 0.99;  // costs 1 % of the variance at most
  constexpr double three_sigma2 = 9;
  constexpr double held = 1e6;  // precision in units of H that leaves nothing to the structured estimate
  MotionPrior prior;
  if (!(levels.delta_d_px > 0)) return prior;
  Directions at = directions_of(depth_information(data, start, levels, kernel));
  if (!at.determined || at.lambda[0] > strong) return prior;
  const std::optional<SE3> mean = motion_of_measured_depths(data, start, levels, kernel);
  if (!mean) return prior;
  const DepthInformation information = depth_information(data, *mean, levels, kernel);
  at = directions_of(information);
  NoiseLevels previous = levels;
  previous.delta_d_curr_px = 0;
  const DepthInformation measured = depth_information(data, *mean, previous, kernel);
  if (!at.determined) return prior;
  // Relief that is not itself significant tells nothing: lambda has a standard deviation of sqrt(2 / n).
  const double least = std::sqrt(three_sigma2 * 2 / static_cast<double>(data.n_used()));
  const Vector6d gradient = at.directions.transpose() * accumulate(data, *mean, levels, kernel).gradient;
  prior.covariance = measured.total.ldlt().solve(Matrix6d::Identity());
  const Matrix6d to_coordinates = at.directions.transpose() * information.total;  // inverse of the directions
  prior.cross = (measured.total - measured.errors + information.errors) * prior.covariance;
  const Vector6d common = (at.directions.transpose() * prior.cross * to_coordinates.transpose()).diagonal();
  const Vector6d variance = (to_coordinates * prior.covariance * to_coordinates.transpose()).diagonal();
  Vector6d precision = Vector6d::Zero();
  Vector6d bias = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const double lambda = std::max(at.lambda[i], least);
    if (lambda * lambda * variance[i] >= 1) continue;  // the structured estimate is no worse
    const double difference2 = std::pow(gradient[i] / lambda, 2);
    const double variance_of_difference = 1 / (lambda * lambda) - 2 * common[i] / lambda + variance[i];
    if (!(variance_of_difference > 0)) continue;
    const double z2 = difference2 / variance_of_difference;
    const double share = at.lambda[i] < least ? 0 : std::max(0.0, 1 - three_sigma2 / z2);
    precision[i] = share * held > lambda * (1 - share) ? lambda * (1 - share) / share : held;
    bias[i] = std::pow(1 - share, 2) * std::max(0.0, difference2 - variance_of_difference);
  }
  prior.mean = *mean;
  prior.precision = to_coordinates.transpose() * precision.asDiagonal() * to_coordinates;
  prior.bias = at.directions * bias.asDiagonal() * at.directions.transpose();
  return prior;
}

Matrix6d motion_covariance(const DepthInformation& information, const MotionPrior& prior) {
  // The optimum errs by M^-1 (g + P e): M = H - B + P, g: score of the points, var(g) = H, e: error of the
  // mean.
  const Matrix6d& H = information.total;
  const Matrix6d& P = prior.precision;
  const Eigen::LDLT<Matrix6d> curvature(H - information.errors + P);
  if (curvature.info() != Eigen::Success || !(curvature.vectorD().minCoeff() > 0)) {
    return Matrix6d::Constant(INFINITY);
  }
  const Matrix6d score = H + P * prior.covariance * P + prior.cross * P + P * prior.cross.transpose();
  const Matrix6d half = curvature.solve(score);
  const Matrix6d out = curvature.solve(half.transpose()) + prior.bias;
  return 0.5 * (out + out.transpose());
}

}  // namespace sextant
