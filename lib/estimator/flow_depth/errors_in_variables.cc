#include "sextant/estimator/flow_depth/errors_in_variables.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "sextant/geometry/lanes.h"

namespace sextant {
namespace {

constexpr int n_matrix = 21;                 // upper triangle, row by row
constexpr size_t information_sample = 1000;  // up to twice as many points represent H and B of all points

/// Points in the current frame: x, y = u', v' normalised, c = 1 / z'; their derivatives with respect to s;
/// information of c; variance of s; weight of the kernel.
struct MovedPoints {
  std::vector<double> x, y, c, dx, dy, dc, info_c, variance, weight;

  explicit MovedPoints(size_t capacity) {
    for (auto* array : arrays()) array->reserve(capacity + n_lanes);
  }
  std::array<std::vector<double>*, 9> arrays() {
    return {&x, &y, &c, &dx, &dy, &dc, &info_c, &variance, &weight};
  }
  void pad() {
    for (auto* array : arrays()) array->resize((array->size() + n_lanes - 1) / n_lanes * n_lanes);
  }
};

/// Computes sums = [sum w J^T S^-1 J, sum w var(s) J'^T S^-1 J'] of x, y, c, S^-1 = diag(info) - b b^T
/// var(s), b = diag(info) (x', y', c').
SEXTANT_SIMD void information_lanes(const MovedPoints& p, double info_x, double info_y, double* sums) {
  Lanes total[2 * n_matrix] = {};
  const Lanes zero = {};
  for (size_t i = 0; i < p.x.size(); i += n_lanes) {
    const Lanes x = SEXTANT_LOAD(&p.x[i]), dx = SEXTANT_LOAD(&p.dx[i]);
    const Lanes y = SEXTANT_LOAD(&p.y[i]), dy = SEXTANT_LOAD(&p.dy[i]);
    const Lanes c = SEXTANT_LOAD(&p.c[i]), dc = SEXTANT_LOAD(&p.dc[i]);
    const Lanes info_c = SEXTANT_LOAD(&p.info_c[i]);
    const Lanes variance = SEXTANT_LOAD(&p.variance[i]);
    const Lanes weight = SEXTANT_LOAD(&p.weight[i]);
    const Lanes xy = dx * y + x * dy;
    const Lanes rows[2][3][6] = {{{c, zero, -x * c, -x * y, 1.0 + x * x, -y},
                                  {zero, c, -y * c, -1.0 - y * y, x * y, x},
                                  {zero, zero, -c * c, -c * y, c * x, zero}},
                                 {{dc, zero, -dx * c - x * dc, -xy, 2.0 * x * dx, -dy},
                                  {zero, dc, -dy * c - y * dc, -2.0 * y * dy, xy, dx},
                                  {zero, zero, -2.0 * c * dc, -dy * c - y * dc, dx * c + x * dc, zero}}};
    for (int which = 0; which < 2; ++which) {
      const Lanes(&J)[3][6] = rows[which];
      const Lanes scale = which == 0 ? weight : weight * variance;
      Lanes b[6];
      for (int a = 0; a < 6; ++a) {
        b[a] = info_x * dx * J[0][a] + info_y * dy * J[1][a] + info_c * dc * J[2][a];
      }
      int k = which * n_matrix;
      for (int a = 0; a < 6; ++a) {
        const Lanes u = scale * info_x * J[0][a];
        const Lanes v = scale * info_y * J[1][a];
        const Lanes d = scale * info_c * J[2][a];
        const Lanes e = scale * variance * b[a];
        for (int col = a; col < 6; ++col) {
          total[k++] += u * J[0][col] + v * J[1][col] + d * J[2][col] - e * b[col];
        }
      }
    }
  }
  for (int k = 0; k < 2 * n_matrix; ++k) {
    sums[k] = sum_of_lanes(&total[k]);
  }
}

Matrix6d symmetric(const double* upper) {
  Matrix6d out;
  for (int a = 0; a < 6; ++a) {
    for (int b = a; b < 6; ++b) out(a, b) = out(b, a) = *upper++;
  }
  return out;
}

/// Eigenvectors of H^-1/2 (H - B) H^-1/2: twist = directions * coordinates, in which H is the identity.
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

template <typename Real>
DepthInformation depth_information(const FlowDepthPoints<Real>& data, const SE3& T_curr_prev,
                                   const NoiseLevels& levels, const RobustKernel& kernel) {
  const PinholeCamera& camera = data.camera().left;
  const double info_u = 1 / (levels.sigma_flow_u_px * levels.sigma_flow_u_px);
  const double info_v = 1 / (levels.sigma_flow_v_px * levels.sigma_flow_v_px);
  const size_t used = data.n_used();
  const size_t stride = std::max<size_t>(used / information_sample, 1);
  MovedPoints points(used / stride + 1);
  size_t seen = 0;
  for (size_t i = 0; i < data.size(); ++i) {
    if (!data.used(i) || seen++ % stride != 0 || !std::isfinite(data.q(i))) continue;
    const PointDepths depths = data.depths(i, levels);
    const double s = data.inverse_depth(i);
    const double w = s / data.inverse_depth_curr(i);
    const double dc = (w - s * T_curr_prev.translation().z()) / (w * w);
    const double info_c = depths.weight_curr * depths.weight_curr;
    const double info_s = info_u * data.slope_u(i) * data.slope_u(i) +
                          info_v * data.slope_v(i) * data.slope_v(i) + info_c * dc * dc +
                          depths.weight * depths.weight;
    points.x.push_back(data.x_curr(i));
    points.y.push_back(data.y_curr(i));
    points.c.push_back(data.inverse_depth_curr(i));
    points.dx.push_back(data.slope_u(i) / camera.fx);
    points.dy.push_back(data.slope_v(i) / camera.fy);
    points.dc.push_back(dc);
    points.info_c.push_back(info_c);
    points.variance.push_back(depths.weight > 0 ? 1 / info_s : 0);
    points.weight.push_back(kernel.weight(data.q(i)));
  }
  const size_t sampled = points.x.size();
  if (sampled == 0) return {};
  points.pad();
  std::array<double, 2 * n_matrix> sums{};
  information_lanes(points, info_u * camera.fx * camera.fx, info_v * camera.fy * camera.fy, sums.data());
  const double scale = static_cast<double>(used) / static_cast<double>(sampled);
  return DepthInformation{symmetric(sums.data()), symmetric(sums.data() + n_matrix)}.times(scale);
}

template DepthInformation depth_information(const FlowDepthData&, const SE3&, const NoiseLevels&,
                                            const RobustKernel&);
template DepthInformation depth_information(const RoughFlowDepthData&, const SE3&, const NoiseLevels&,
                                            const RobustKernel&);

std::optional<SE3> motion_of_measured_depths(RoughFlowDepthData& data, const SE3& start, NoiseLevels levels,
                                             const RobustKernel& kernel) {
  constexpr int max_steps = 10;
  constexpr double tolerance = 1e-5;  // the next step would be below the precision
  levels.as_measured = true;
  levels.delta_d_curr_px = 0;
  std::optional<SE3> X = start;
  double size = INFINITY;
  for (int k = 0; k < max_steps && X && size >= tolerance; ++k) {
    X = step_flow_depth(data, *X, levels, kernel, &size);
  }
  return X;
}

bool has_weak_directions(const DepthInformation& information) {
  constexpr double strong = 0.99;  // costs at most 1 % of the variance
  const Directions at = directions_of(information);
  return at.determined && at.lambda[0] <= strong;
}

MotionPrior weak_direction_prior(const SE3& mean, const DepthInformation& information,
                                 const DepthInformation& measured, const Vector6d& gradient,
                                 size_t n_points) {
  constexpr double three_sigma2 = 9;
  constexpr double held = 1e6;  // precision in units of H at which the structured estimate has no influence
  MotionPrior prior;
  const Directions at = directions_of(information);
  if (!at.determined) return prior;
  // Insignificant relief is not used: lambda has a standard deviation of sqrt(2 / n).
  const double least = std::sqrt(three_sigma2 * 2 / static_cast<double>(n_points));
  const Vector6d along = at.directions.transpose() * gradient;
  prior.covariance = measured.total.ldlt().solve(Matrix6d::Identity());
  const Matrix6d to_coordinates = at.directions.transpose() * information.total;  // inverse of the directions
  prior.cross = (measured.total - measured.errors + information.errors) * prior.covariance;
  const Vector6d common = (at.directions.transpose() * prior.cross * to_coordinates.transpose()).diagonal();
  const Vector6d variance = (to_coordinates * prior.covariance * to_coordinates.transpose()).diagonal();
  Vector6d precision = Vector6d::Zero();
  Vector6d bias = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const bool has_relief = at.lambda[i] >= least;
    const double lambda = std::max(at.lambda[i], least);
    const double difference2 = std::pow(along[i] / lambda, 2);
    const double of_difference = std::max(0.0, 1 / (lambda * lambda) - 2 * common[i] / lambda + variance[i]);
    const bool is_no_better = lambda * lambda * variance[i] >= 1 || !(of_difference > 0);
    if (is_no_better && at.lambda[i] > 0) continue;  // the structured estimate is good enough
    const double share = has_relief ? std::max(0.0, 1 - three_sigma2 * of_difference / difference2) : 0;
    precision[i] = share * held > lambda * (1 - share) ? lambda * (1 - share) / share : held;
    bias[i] = std::pow(1 - share, 2) * std::max(0.0, difference2 - of_difference);
  }
  prior.mean = mean;
  prior.precision = to_coordinates.transpose() * precision.asDiagonal() * to_coordinates;
  prior.bias = at.directions * bias.asDiagonal() * at.directions.transpose();
  return prior;
}

MotionPrior weak_directions(RoughFlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                            const RobustKernel& kernel) {
  if (!(levels.delta_d_px > 0)) return {};
  RoughFlowDepthData some = data.sample(information_sample);
  evaluate_points(some, start, levels);
  if (!has_weak_directions(depth_information(some, start, levels, kernel))) return {};
  const std::optional<SE3> mean = motion_of_measured_depths(data, start, levels, kernel);
  if (!mean) return {};
  const double more = static_cast<double>(data.n_used()) / static_cast<double>(some.size());
  const auto information_of = [&](const NoiseLevels& of) {
    evaluate_points(some, *mean, of);
    return depth_information(some, *mean, of, kernel).times(more);
  };
  const DepthInformation information = information_of(levels);
  NoiseLevels previous = levels;
  previous.delta_d_curr_px = 0;
  const DepthInformation measured = information_of(previous);
  return weak_direction_prior(*mean, information, measured, accumulate(data, *mean, levels, kernel).gradient,
                              data.n_used());
}

Matrix6d motion_covariance(const DepthInformation& information, const MotionPrior& prior) {
  const Matrix6d& P = prior.precision;
  return motion_covariance(
      information, prior,
      information.total + P * prior.covariance * P + prior.cross * P + P * prior.cross.transpose());
}

Matrix6d motion_covariance(const DepthInformation& information, const MotionPrior& prior,
                           const Matrix6d& scores) {
  // Error of the optimum: M^-1 (g + P e), M = H - B + P, with g the score of the points, var(g) = H, and e
  // the error of the prior's mean.
  const Eigen::LDLT<Matrix6d> curvature(information.total - information.errors + prior.precision);
  if (curvature.info() != Eigen::Success || !(curvature.vectorD().minCoeff() > 0)) {
    return Matrix6d::Constant(INFINITY);
  }
  const Matrix6d half = curvature.solve(scores);
  const Matrix6d out = curvature.solve(half.transpose()) + prior.bias;
  return 0.5 * (out + out.transpose());
}

}  // namespace sextant
