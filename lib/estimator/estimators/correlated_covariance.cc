#include "sextant/estimator/estimators/correlated_covariance.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sextant/estimator/solvers/degeneracy.h"
#include "sextant/estimator/solvers/error_parts.h"

namespace sextant {
namespace {

constexpr int offset = 6;  // unknown of ErrorScore

std::optional<SpatialCorrelation> declared_correlation(const Problem& problem) {
  if (!problem.noise || !(problem.noise->flow_x_px > 0)) return std::nullopt;
  return problem.noise->correlation;
}

ErrorParts parts_of(const SpatialCorrelation& correlation, double variance) {
  const Lanes one = {1, 1, 1, 1};
  return {variance * correlation.independent_share() * one, variance * one, correlation.parts};
}

/// Of every `stride`-th point. Residuals are those that pull: times the kernel's weight over the mean of its slope.
std::vector<ErrorScore> scores_of(const FlowDepthData& points, const NoiseLevels& levels,
                                  const RobustKernel& kernel, const SE3& X, size_t stride) {
  const StereoCamera& camera = points.camera();
  const double per_u = 1 / levels.sigma_flow_u_px, per_v = 1 / levels.sigma_flow_v_px;
  std::vector<ErrorScore> scores;
  scores.reserve(points.size() / stride + 1);
  double slope = 0;
  for (size_t i = 0; i < points.size(); i += stride) {
    if (!std::isfinite(points.q(i))) continue;
    const PointDepths depths = points.depths(i, levels);
    const double fu = camera.left.fx * per_u, fv = camera.left.fy * per_v;
    const double x = points.x_curr(i), y = points.y_curr(i), c = points.inverse_depth_curr(i);
    const double s = points.inverse_depth(i), w = s / c, now = depths.weight_curr;
    ErrorScore& score = scores.emplace_back();
    score.u = points.column(FlowDepthData::x)[i] * camera.left.fx + camera.left.cx;
    score.v = points.column(FlowDepthData::y)[i] * camera.left.fy + camera.left.cy;
    score.measured = Lanes{1, 1, depths.weight > 0 ? 1.0 : 0.0, now > 0 ? 1.0 : 0.0};
    score.derivative[0] = Lanes{fu * c, 0, 0, 0};
    score.derivative[1] = Lanes{0, fv * c, 0, 0};
    score.derivative[2] = Lanes{-fu * x * c, -fv * y * c, 0, -now * c * c};
    score.derivative[3] = Lanes{-fu * x * y, -fv * (1 + y * y), 0, -now * c * y};
    score.derivative[4] = Lanes{fu * (1 + x * x), fv * x * y, 0, now * c * x};
    score.derivative[5] = Lanes{-fu * y, fv * x, 0, 0};
    score.derivative[offset] = Lanes{0, 0, -depths.weight / camera.bf, -now / camera.bf};
    const double weight = kernel.weight(points.q(i));
    slope += weight + kernel.bend(points.q(i)) / (now > 0 ? 3 : 2);
    score.residual =
        weight * Lanes{points.error_u(i) * per_u, points.error_v(i) * per_v,
                       depths.weight * (s - depths.inverse_depth), now * (c - depths.inverse_depth_curr)};
    if (!(depths.weight > 0)) continue;
    const Lanes by_depth = Lanes{points.slope_u(i) * per_u, points.slope_v(i) * per_v, depths.weight,
                                 now * (w - s * X.translation().z()) / (w * w)};
    const Lanes squares = by_depth * by_depth;
    score.by_depth = by_depth / std::sqrt(sum_of_lanes(&squares));
  }
  for (ErrorScore& score : scores) {
    score.residual *= static_cast<double>(scores.size()) / slope;
    score.eliminate_depth();
  }
  return scores;
}

/// Derivatives by the motion times this lower triangular matrix.
void change_coordinates(const Matrix6d& to, std::vector<ErrorScore>& scores) {
  for (ErrorScore& score : scores) {
    for (int a = 5; a >= 0; --a) {
      Lanes sum = to(a, a) * score.derivative[a];
      for (int b = 0; b < a; ++b) sum += to(a, b) * score.derivative[b];
      score.derivative[a] = sum;
    }
  }
}

/// The mean of `prior` errs as well, by the errors of the same points but without current depths: `pull` times
/// their scores.
void add_errors_of_mean(const Matrix6d& pull, const FlowDepthData& points, NoiseLevels levels, const SE3& X,
                        size_t stride, std::vector<ErrorScore>& scores) {
  levels.delta_d_curr_px = 0;
  const std::vector<ErrorScore> measured = scores_of(points, levels, {}, X, stride);
  for (size_t i = 0; i < scores.size(); ++i) {
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 6; ++b) scores[i].derivative[a] += pull(a, b) * measured[i].derivative[b];
    }
  }
}

/// L of S = L L^T; none if S is not positive definite.
std::optional<Matrix6d> lower_factor(const Matrix6d& S) {
  const Eigen::LLT<Matrix6d> factor(S);
  return factor.info() == Eigen::Success ? std::optional<Matrix6d>(factor.matrixL()) : std::nullopt;
}
Matrix6d inverse_of_lower(const Matrix6d& L) {
  return L.triangularView<Eigen::Lower>().solve(Matrix6d::Identity());
}

using UnknownsVector = Eigen::Matrix<double, ErrorScore::n_unknowns, 1>;

/// Square of a common offset of the disparities (px^2) beyond the variance of its estimate; 0 where that does not
/// tell it to one pixel. `pull`: derivatives times residuals; `fisher`, `covariance`: M of independent and of all
/// errors.
double squared_offset(const UnknownsVector& pull, const ScoreMatrix& fisher, const ScoreMatrix& covariance) {
  constexpr double known_px = 1;
  UnknownsVector along;
  along << -fisher.topLeftCorner<6, 6>().ldlt().solve(fisher.col(offset).head<6>()), 1;
  const double information = along.dot(fisher * along);
  if (!(information > 0)) return 0;
  const double squared = std::pow(along.dot(pull) / information, 2);
  const double variance = along.dot(covariance * along) / (information * information);
  return variance < known_px * known_px ? std::max(squared - variance, 0.0) : 0;
}

/// Over all points, derivatives in every unknown times: the residuals, the effect of an offset.
struct Pulls {
  UnknownsVector of_residuals, of_offset;
  explicit Pulls(const std::vector<ErrorScore>& points) {
    for (int a = 0; a < ErrorScore::n_unknowns; ++a) {
      Lanes by_residual = {}, by_offset = {};
      for (const ErrorScore& point : points) {
        by_residual += point.derivative[a] * point.residual;
        by_offset += point.derivative[a] * point.derivative[offset];
      }
      of_residuals[a] = sum_of_lanes(&by_residual);
      of_offset[a] = sum_of_lanes(&by_offset);
    }
  }
};

}  // namespace

void correlate(const Problem& problem, const FlowDepthData& points, const NoiseLevels& levels,
               const RobustKernel& kernel, const MotionPrior& prior, const DepthInformation& information,
               double inflation, MotionEstimate& estimate) {
  constexpr size_t enough = 500;  // to twice as many tell of all of them
  const std::optional<SpatialCorrelation> declared = declared_correlation(problem);
  if (declared && declared->parts.empty()) return;
  const SE3& X = estimate.T_curr_prev;
  const size_t stride = declared ? 1 : std::max<size_t>(points.size() / enough, 1);
  std::vector<ErrorScore> scores = scores_of(points, levels, kernel, X, stride);
  // In coordinates in which independent errors have the unit matrix, so that no direction is lost in rounding.
  std::optional<Matrix6d> L = lower_factor(information.total);
  if (scores.empty() || !L) return;
  change_coordinates(inverse_of_lower(*L), scores);
  const double of_each = static_cast<double>(points.size()) / static_cast<double>(scores.size());
  ErrorParts parts = declared ? parts_of(*declared, 1) : estimate_error_parts(scores);
  // Errors are at least as large as independent ones are taken to be.
  parts.raise_to(declared ? inflation : 1);
  const auto covariance_of_scores = [&](const ChannelScores& independent) -> ScoreMatrix {
    return of_each * independent.times(parts.independent) +
           of_each * of_each * correlated_scores(scores, parts.shape).times(parts.correlated);
  };
  const ChannelScores independent = independent_scores(scores);
  ScoreMatrix covariance = covariance_of_scores(independent);
  double squared = 0;
  if (!declared && levels.delta_d_px > 0) {
    squared = squared_offset(of_each * Pulls(scores).of_residuals,
                             of_each * independent.times(Lanes{1, 1, 1, 1}), covariance);
  }
  if (prior.holds()) {
    const Matrix6d pull = prior.precision * prior.covariance;
    const std::optional<Matrix6d> with_mean =
        lower_factor(information.total + pull * prior.precision.transpose());
    if (!with_mean) return;
    const Matrix6d to = inverse_of_lower(*with_mean);
    change_coordinates(to * *L, scores);
    add_errors_of_mean(to * pull, points, levels, X, stride, scores);
    L = with_mean;
    covariance = covariance_of_scores(independent_scores(scores));
  }
  if (squared > 0) {
    const UnknownsVector by_offset = of_each * Pulls(scores).of_offset;
    covariance += squared * by_offset * by_offset.transpose();
  }
  replace_covariance(
      motion_covariance(information, prior, *L * covariance.topLeftCorner<6, 6>() * L->transpose()),
      estimate);
}

void correlate(const Problem& problem, const HuberKernel& kernel, MotionEstimate& estimate) {
  const Correspondences& p = problem.points;
  const PinholeCamera& camera = problem.camera.left;
  const double per_sigma = 1 / kernel.sigma_px;
  std::vector<ErrorScore> scores;
  Matrix6d hessian = Matrix6d::Zero();
  double squares = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    if (estimate.inliers[i] == 0) continue;
    const Eigen::Vector3d q = estimate.T_curr_prev * camera.backproject(p.u[i], p.v[i], p.depth[i]);
    if (!(q.z() > min_depth_m)) continue;
    const double c = 1 / q.z(), x = q.x() * c, y = q.y() * c;
    const Eigen::Vector2d r =
        per_sigma * (camera.project(q) - Eigen::Vector2d(p.u[i] + p.flow_u[i], p.v[i] + p.flow_v[i]));
    const bool outer = r.norm() > kernel.threshold;
    const double weight = outer ? kernel.threshold / r.norm() : 1;
    Eigen::Matrix<double, 2, 6> J;
    J << c, 0, -x * c, -x * y, 1 + x * x, -y, 0, c, -y * c, -1 - y * y, x * y, x;
    J.row(0) *= camera.fx * per_sigma;
    J.row(1) *= camera.fy * per_sigma;
    const Eigen::Matrix2d along = r * r.transpose() / r.squaredNorm();
    hessian +=
        J.transpose() *
        (outer ? (weight * (Eigen::Matrix2d::Identity() - along)).eval() : Eigen::Matrix2d::Identity()) * J;
    ErrorScore& score = scores.emplace_back();
    score.u = p.u[i];
    score.v = p.v[i];
    score.measured = Lanes{1, 1, 0, 0};
    for (int a = 0; a < 6; ++a) score.derivative[a] = Lanes{J(0, a), J(1, a), 0, 0};
    score.residual = Lanes{weight * r.x(), weight * r.y(), 0, 0};
    squares += weight * weight * r.squaredNorm();
  }
  const std::optional<Matrix6d> L = lower_factor(hessian);
  if (scores.empty() || !L) return;
  const Matrix6d to = inverse_of_lower(*L);
  change_coordinates(to, scores);
  const std::optional<SpatialCorrelation> declared = declared_correlation(problem);
  const double variance = squares / (2 * static_cast<double>(scores.size()));
  const ErrorParts parts = declared ? parts_of(*declared, variance) : estimate_error_parts(scores);
  const ScoreMatrix M = independent_scores(scores).times(parts.independent) +
                        correlated_scores(scores, parts.shape).times(parts.correlated);
  const Matrix6d covariance = to.transpose() * M.topLeftCorner<6, 6>() * to;
  replace_covariance(0.5 * (covariance + covariance.transpose()), estimate);
}

}  // namespace sextant
