#include "sextant/estimator/flow_depth/correlated_covariance.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sextant/estimator/flow_depth/correlated_weights.h"
#include "sextant/estimator/solvers/degeneracy.h"

namespace sextant {
namespace {

constexpr int offset = 6;  // index of the common offset in ErrorScore

std::optional<SpatialCorrelation> declared_correlation(const Problem& problem) {
  return declares_errors(problem) ? std::optional(problem.noise->correlation) : std::nullopt;
}

ErrorParts parts_of(const SpatialCorrelation& correlation, double variance) {
  const Lanes one = {1, 1, 1, 1};
  return {variance * correlation.independent_share() * one, variance * one, correlation.parts};
}

/// Multiplies the derivatives with respect to the motion by this lower triangular matrix, stored row by row.
SEXTANT_INLINED void transform(const double* to, ErrorScore& score) {
  for (int a = 5; a >= 0; --a) {
    Lanes sum = to[6 * a + a] * score.derivative[a];
    for (int b = 0; b < a; ++b) sum += to[6 * a + b] * score.derivative[b];
    score.derivative[a] = sum;
  }
}
SEXTANT_SIMD void transform_all(const double* to, std::vector<ErrorScore>& scores) {
  for (ErrorScore& score : scores) transform(to, score);
}
void change_coordinates(const Matrix6d& to, std::vector<ErrorScore>& scores) {
  const Eigen::Matrix<double, 6, 6, Eigen::RowMajor> rows = to;
  transform_all(rows.data(), scores);
}

/// Factors shared by all points.
struct ScoreUnits {
  double fx, fy, cx, cy, bf;
  double per_u, per_v;               ///< 1 / sigma
  double per_depth, per_depth_curr;  ///< bf / sigma
  double t_z;
};

/// Computes the scores, with derivatives multiplied by `to`; returns the mean of div psi / d (graduation.h)
/// over the points in front of the camera, 0 if there is none.
SEXTANT_SIMD double fill_scores(const FlowDepthData& points, const ScoreUnits& k, const RobustKernel& kernel,
                                const double* to, ErrorScore* out) {
  double slope = 0, n_seen = 0;
  const double fu = k.fx * k.per_u, fv = k.fy * k.per_v, by_offset = -k.per_depth / k.bf;
  for (size_t i = 0; i < points.size(); ++i) {
    ErrorScore& score = out[i];
    score.u = points.column(FlowDepthData::x)[i] * k.fx + k.cx;
    score.v = points.column(FlowDepthData::y)[i] * k.fy + k.cy;
    const double q = points.q(i);
    if (!(q < INFINITY)) continue;
    const double now = std::sqrt(points.column(FlowDepthData::has_curr)[i]) * k.per_depth_curr;
    const double x = points.x_curr(i), y = points.y_curr(i), c = points.inverse_depth_curr(i);
    const double s = points.inverse_depth(i);
    score.measured = Lanes{1, 1, k.per_depth > 0 ? 1.0 : 0.0, now > 0 ? 1.0 : 0.0};
    score.derivative[0] = Lanes{fu * c, 0, 0, 0};
    score.derivative[1] = Lanes{0, fv * c, 0, 0};
    score.derivative[2] = Lanes{-fu * x * c, -fv * y * c, 0, -now * c * c};
    score.derivative[3] = Lanes{-fu * x * y, -fv * (1 + y * y), 0, -now * c * y};
    score.derivative[4] = Lanes{fu * (1 + x * x), fv * x * y, 0, now * c * x};
    score.derivative[5] = Lanes{-fu * y, fv * x, 0, 0};
    score.derivative[offset] = Lanes{0, 0, by_offset, -now / k.bf};
    const double weight = kernel.weight(q);
    n_seen += 1;
    slope += weight + kernel.curvature_term(q) / (now > 0 ? 3 : 2);
    score.residual = weight * Lanes{points.error_u(i) * k.per_u, points.error_v(i) * k.per_v,
                                    k.per_depth * (s - points.column(FlowDepthData::measured)[i]),
                                    now * (c - points.column(FlowDepthData::measured_curr)[i])};
    if (k.per_depth > 0) {
      const double w = s / c;
      Lanes by_depth = Lanes{points.slope_u(i) * k.per_u, points.slope_v(i) * k.per_v, k.per_depth,
                             now * (w - s * k.t_z) / (w * w)};
      const Lanes squares = by_depth * by_depth;
      by_depth /= std::sqrt(sum_of_lanes(&squares));
      score.by_depth = by_depth;
      score.eliminate_depth();
    }
    transform(to, score);
  }
  return n_seen > 0 ? slope / n_seen : 0;
}

/// Returns the scores of all points. Points behind the camera have no measurements. Residuals are multiplied
/// by the kernel's weight over the mean that fill_scores() returns; derivatives with respect to the motion
/// are multiplied by `to`, lower triangular.
std::vector<ErrorScore> scores_of(const FlowDepthData& points, const NoiseLevels& levels,
                                  const RobustKernel& kernel, const SE3& X, const Matrix6d& to) {
  const StereoCamera& camera = points.camera();
  const auto per = [&](double delta_d_px) { return delta_d_px > 0 ? camera.bf / delta_d_px : 0.0; };
  const ScoreUnits units = {camera.left.fx,
                            camera.left.fy,
                            camera.left.cx,
                            camera.left.cy,
                            camera.bf,
                            1 / levels.sigma_flow_u_px,
                            1 / levels.sigma_flow_v_px,
                            per(levels.delta_d_px),
                            per(levels.delta_d_curr_px),
                            X.translation().z()};
  const Eigen::Matrix<double, 6, 6, Eigen::RowMajor> rows = to;
  std::vector<ErrorScore> scores(points.size());
  const double slope = fill_scores(points, units, kernel, rows.data(), scores.data());
  for (ErrorScore& score : scores) {
    if (slope > 0) score.residual /= slope;
  }
  return scores;
}

/// Returns true if more than half of the points have disparities in both frames. The level of the disparities
/// is then estimated from their differences (noise_levels.h), in which persistent errors cancel.
bool compares_disparities(const std::vector<ErrorScore>& scores) {
  const auto n = std::ranges::count_if(scores, [](const ErrorScore& score) { return score.measured[3] > 0; });
  return 2 * static_cast<size_t>(n) > scores.size();
}

/// Returns L of S = L L^T; nullopt if S is not positive definite.
std::optional<Matrix6d> lower_factor(const Matrix6d& S) {
  const Eigen::LLT<Matrix6d> factor(S);
  return factor.info() == Eigen::Success ? std::optional<Matrix6d>(factor.matrixL()) : std::nullopt;
}
Matrix6d inverse_of_lower(const Matrix6d& L) {
  return L.triangularView<Eigen::Lower>().solve(Matrix6d::Identity());
}

/// First-order estimate, from X, of the motion that treats depths as exact, and the contribution of each
/// point.
struct MeasuredDepths {
  Vector6d step;  ///< from X, as a left twist
  DepthInformation information;
  std::vector<ErrorScore> scores;
  WeightedEquations equations;

  MeasuredDepths(FlowDepthData points, NoiseLevels levels, const RobustKernel& kernel, const SE3& X,
                 const Matrix6d& L, const ErrorParts& weights, double of_each) {
    levels.delta_d_curr_px = 0;
    evaluate_points(points, X, levels);
    const Matrix6d errors = depth_information(points, X, levels, {}).errors;
    levels.as_measured = true;
    evaluate_points(points, X, levels);
    scores = scores_of(points, levels, kernel, X, inverse_of_lower(L));
    equations = weigh(scores, weights, of_each);
    information = {L * equations.curvature.topLeftCorner<6, 6>() * L.transpose(),
                   of_each * equations.independent * errors};
    step = -L.transpose().triangularView<Eigen::Upper>().solve(
        equations.curvature.topLeftCorner<6, 6>().ldlt().solve(equations.gradient.head<6>()));
  }
};

/// Adds `factor` times the derivatives of `from` with respect to the motion to `to`.
void add(const Matrix6d& factor, const std::vector<ErrorScore>& from, std::vector<ErrorScore>& to) {
  for (size_t i = 0; i < to.size(); ++i) {
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 6; ++b) to[i].derivative[a] += factor(a, b) * from[i].derivative[b];
    }
  }
}

/// Returns the square of a common offset of the disparities (px^2) minus the variance of its estimate; 0 if
/// the offset is not determined to one pixel. The estimate is gradient over information; `variance` is that
/// of the gradient.
double squared_offset(double gradient, double information, double variance) {
  constexpr double known_px = 1;
  if (!(information > 0)) return 0;
  const double of_estimate = variance / (information * information);
  const double squared = std::pow(gradient / information, 2);
  return of_estimate < known_px * known_px ? std::max(squared - of_estimate, 0.0) : 0;
}

}  // namespace

bool declares_errors(const Problem& problem) { return problem.noise && problem.noise->flow_x_px > 0; }

std::optional<CorrelatedEstimate> correlate(const Problem& problem, const FlowDepthData& points,
                                            size_t n_points, const NoiseLevels& levels,
                                            const RobustKernel& kernel, const DepthInformation& independent,
                                            double inflation, bool is_weak, const ErrorModel* known,
                                            const SE3& X) {
  const std::optional<SpatialCorrelation> declared = declared_correlation(problem);
  if (declared && declared->parts.empty()) return std::nullopt;
  CorrelatedEstimate out{X, false, Matrix6d::Constant(INFINITY), nullptr};
  // Scores are computed in coordinates in which the covariance of independent errors is the identity, so that
  // no direction is lost in rounding.
  const std::optional<Matrix6d> L = lower_factor(independent.total);
  if (points.size() == 0 || !L) return out;
  const Matrix6d to = inverse_of_lower(*L);
  std::vector<ErrorScore> scores = scores_of(points, levels, kernel, X, to);
  ErrorParts parts = known != nullptr ? known->parts
                     : declared       ? parts_of(*declared, 1)
                                      : estimate_error_parts(scores);
  // The errors are at least as large as those of the independent model.
  if (known == nullptr) {
    parts.raise_to(declared ? inflation : 1);
    if (!declared && compares_disparities(scores)) parts.persistent = persistent_ratio;
  }
  const bool reweighs = parts.correlate() && parts.significant;
  // Each score represents the points left out between the samples.
  const double all = static_cast<double>(n_points) / static_cast<double>(scores.size());
  const double of_each = reweighs ? 1 : all;
  const ErrorParts weights = reweighs ? parts : ErrorParts{};
  const WeightedEquations equations = weigh(scores, weights, of_each);
  DepthInformation information = {*L * equations.curvature.topLeftCorner<6, 6>() * L->transpose(),
                                  of_each / all * equations.independent * independent.errors};
  const Vector6d gradient = *L * equations.gradient.head<6>();
  const Vector6d across = *L * equations.curvature.col(offset).head<6>();
  Vector6d by_offset = across;
  MotionPrior prior;
  Vector6d to_mean = Vector6d::Zero();
  Matrix6d of_prior = Matrix6d::Zero();
  if ((is_weak || !lower_factor(information.total - information.errors)) &&
      has_weak_directions(information)) {
    const MeasuredDepths measured(points.sample(points.size()), levels, kernel, X, *L, weights, of_each);
    to_mean = measured.step;
    prior =
        weak_direction_prior(SE3::exp(to_mean) * X, information, measured.information,
                             gradient + (information.total - information.errors) * to_mean, scores.size());
    if (prior.holds()) {
      // The prior's mean has errors too, from the errors of the same points.
      of_prior = prior.precision * prior.covariance;
      add(to * of_prior * *L, measured.scores, scores);
      by_offset += of_prior * *L * measured.equations.curvature.col(offset).head<6>();
    }
  }
  const std::optional<Matrix6d> L_all =
      lower_factor(information.total + of_prior * prior.precision.transpose());
  const Eigen::LLT<Matrix6d> curvature(information.total - information.errors + prior.precision);
  if (!L_all || curvature.info() != Eigen::Success) return out;
  Vector6d step = Vector6d::Zero();
  if (reweighs) step = curvature.solve(prior.precision * to_mean - gradient);
  const Matrix6d to_all = inverse_of_lower(*L_all);
  change_coordinates(to_all * *L, scores);
  ScoreMatrix covariance = independent_scores(scores).times(parts.independent / of_each);
  if (parts.correlate()) covariance += smooth_error_scores(scores, parts, levels);
  ErrorModel errors{.levels = levels, .parts = parts, .by_offset = to_all * by_offset};
  if (known != nullptr) {
    errors.squared_offset_px2 = known->squared_offset_px2;
  } else if (!declared && levels.delta_d_px > 0) {
    ScoreVector along;
    along << -L_all->transpose() * curvature.solve(across), 1;
    const double information_of_it =
        equations.curvature(offset, offset) - across.dot(curvature.solve(by_offset));
    errors.squared_offset_px2 = squared_offset(equations.gradient[offset] + across.dot(step),
                                               information_of_it, along.dot(covariance * along));
  }
  const Matrix6d M = covariance.topLeftCorner<6, 6>() +
                     errors.squared_offset_px2 * errors.by_offset * errors.by_offset.transpose();
  const SE3 moved = reweighs ? SE3::exp(step) * X : X;
  if (!moved.is_finite()) return out;
  out.T_curr_prev = moved;
  out.moved = reweighs;
  out.covariance = motion_covariance(information, prior, *L_all * M * L_all->transpose());
  errors.to_twist = curvature.solve(*L_all);
  errors.scores = std::move(scores);
  out.errors = std::make_shared<ErrorModel>(std::move(errors));
  return out;
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
