#include "sextant/estimator/flow_depth/joint_flow_depth.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/quantile.h"
#include "sextant/estimator/flow_depth/correlated_covariance.h"
#include "sextant/estimator/flow_depth/errors_in_variables.h"
#include "sextant/estimator/flow_depth/graduation.h"
#include "sextant/estimator/flow_depth/noise_levels.h"
#include "sextant/estimator/solvers/degeneracy.h"

namespace sextant {
namespace {

using Kind = RobustKernel::Kind;

constexpr size_t min_points = 3;
// The choice of points has converged if it changes for at most one in this many points.
constexpr size_t settled_share = 200;
// Number of points, up to twice as many, that are sufficient to choose the inliers' motion and levels.
constexpr size_t choice_sample = 1000;
// Number of points that are sufficient to estimate the correlation of their errors.
constexpr size_t errors_sample = 220;

/// Returns the kernel scale with the least estimated variance (Jaeckel 1971): large for Gaussian data, small
/// for heavy tails.
double best_scale(const RoughFlowDepthData& data) {
  double best = 0;
  double least = INFINITY;
  for (const double scale : {10.0, 6.0, 4.0, 3.0, 2.0, 1.5}) {
    const double variance = variance_factor(data, {Kind::geman_mcclure, scale});
    if (variance >= least) continue;
    least = variance;
    best = scale;
  }
  return best > 0 ? best : 1.5;
}

/// Includes exactly the points whose q has a chi-square probability below `gate`; returns the number of
/// changes.
size_t gate_points(RoughFlowDepthData& data, const SE3& motion, const NoiseLevels& levels, double gate) {
  const double gate2 = approximate_chi_square_quantile(gate, 2);
  const double gate3 = approximate_chi_square_quantile(gate, 3);
  NoiseLevels without = levels;
  without.delta_d_curr_px = 0;
  const bool has_curr = levels.delta_d_curr_px > 0;
  std::vector<unsigned char> before(data.size());
  for (size_t i = 0; i < data.size(); ++i) {
    before[i] = static_cast<unsigned char>(data.used(i) + 2 * data.uses_depth_curr(i));
    data.use(i, data.is_measurement(i), true);
  }
  std::vector<float> q_both(data.size(), 0);
  if (has_curr) {
    evaluate_distances(data, motion, levels);
    std::copy_n(data.column(RoughFlowDepthData::squared_distance), data.size(), q_both.begin());
  }
  evaluate_distances(data, motion, without);
  float* q = data.column(RoughFlowDepthData::squared_distance);
  size_t changed = 0;
  for (size_t i = 0; i < data.size(); ++i) {
    const bool point = q[i] <= gate2;
    const bool curr = point & has_curr & (q_both[i] <= gate3) & data.measures_depth_curr(i);
    q[i] = curr ? q_both[i] : q[i];
    data.use(i, point, curr);
    changed += before[i] != point + 2 * curr;
  }
  return changed;
}

/// Excludes the points whose flow and previous depth lie outside the gate; returns their number.
size_t drop_points(RoughFlowDepthData& data, const SE3& motion, NoiseLevels levels, double gate) {
  levels.delta_d_curr_px = 0;
  evaluate_distances(data, motion, levels);
  const double gate2 = approximate_chi_square_quantile(gate, 2);
  size_t n = 0;
  for (size_t i = 0; i < data.size(); ++i) {
    if (!data.used(i) || data.q(i) <= gate2) continue;
    data.use(i, false, false);
    ++n;
  }
  return n;
}

/// Returns the noise levels of the options, otherwise those declared by the problem; 0 = to be estimated.
NoiseLevels declared_levels(const Problem& problem, const JointFlowDepthOptions& options) {
  const MeasurementNoise noise = problem.noise.value_or(MeasurementNoise{});
  const auto first = [](double option, double declared) { return option > 0 ? option : declared; };
  NoiseLevels levels;
  levels.sigma_flow_u_px = first(options.sigma_flow_u_px, noise.flow_x_px);
  levels.sigma_flow_v_px = first(options.sigma_flow_v_px, noise.flow_y_px);
  levels.delta_d_px = first(options.delta_d_px, noise.inverse_depth_per_m * problem.camera.bf);
  levels.depth_noise = options.depth_noise;
  return levels;
}

/// Correction and weight of a point's current depth.
struct DepthCurrReading {
  double change = 0;  ///< change of the inverse depth, 1/m
  double share = 0;   ///< share of the information at the given noise levels
};

/// Returns corrections of the current depths, which are read at the nearest whole pixel. The slope of the
/// plane through the neighbourhood corrects for the known subpixel offset; relief of the neighbourhood is
/// added to the variance. Without neighbours the effect is unknown, and the current depth is not used.
std::vector<DepthCurrReading> depth_curr_readings(const Problem& problem, double radius_px,
                                                  const NoiseLevels& levels, const SE3& motion,
                                                  RoughFlowDepthData& data) {
  const Correspondences& p = problem.points;
  const LocalPlanes planes(p, levels.delta_d_px / problem.camera.bf, radius_px);
  evaluate_points(data, motion, levels);
  const double variance = std::pow(levels.delta_d_curr_px / problem.camera.bf, 2);
  std::vector<DepthCurrReading> readings(p.size());
  for (size_t i = 0; i < p.size(); ++i) {
    if (!data.is_measurement(i) || !planes[i].fitted) continue;
    const double u = p.u[i] + p.flow_u[i] + data.error_u(i);
    const double v = p.v[i] + p.flow_v[i] + data.error_v(i);
    readings[i] = {planes[i].slope_u * (u - std::round(u)) + planes[i].slope_v * (v - std::round(v)),
                   variance / (variance + planes[i].relief)};
  }
  return readings;
}

template <typename Real>
void correct_depth_curr(const std::vector<DepthCurrReading>& readings, FlowDepthPoints<Real>& data) {
  for (size_t i = 0; i < readings.size(); ++i) {
    data.shift_inverse_depth_curr(i, readings[i].change);
    data.weaken_depth_curr(i, readings[i].share);
  }
}

/// Chooses the points that agree with the motion, in alternation with steps of the motion on a sample of them
/// until the choice converges; and the kernel that suits them.
void choose_points_and_kernel(const JointFlowDepthOptions& options, RoughFlowDepthData& data,
                              FlowDepthProblem& out) {
  const bool graduated = options.robust == Robust::geman_mcclure_gnc;
  for (size_t i = 0; i < data.size(); ++i) data.use(i, true, false);
  RoughFlowDepthData some = data.sample(choice_sample);
  for (int k = 0; k < 4; ++k) {
    const size_t changed = gate_points(some, out.start, out.levels, options.gate);
    if (k > 0 && changed * settled_share <= some.n_used()) break;
    if (some.n_used() < min_points) break;
    if (graduated) {
      out.kernel = {Kind::geman_mcclure, options.scale > 0 ? options.scale : best_scale(some)};
    } else if (options.robust == Robust::huber) {
      out.kernel = {Kind::huber, options.huber};
    }
    const SolverResult result = descend(some, out.start, out.levels, out.kernel, 1);
    if (!std::isfinite(result.at_optimum.cost) || !result.T_curr_prev.is_finite()) break;
    out.start = result.T_curr_prev;
  }
  gate_points(data, out.start, out.levels, options.gate);
}

}  // namespace

void JointFlowDepthOptions::check() const {
  check_option(sigma_flow_u_px >= 0, "sigma_flow_u_px", sigma_flow_u_px, ">= 0");
  check_option(sigma_flow_v_px >= 0, "sigma_flow_v_px", sigma_flow_v_px, ">= 0");
  check_option(delta_d_px >= 0, "delta_d_px", delta_d_px, ">= 0");
  check_option(projection_share > 0 && projection_share < 1, "projection_share", projection_share,
               "in (0, 1)");
  check_option(huber > 0, "huber", huber, "> 0");
  check_option(scale >= 0, "scale", scale, ">= 0");
  check_option(gate > 0 && gate < 1, "gate", gate, "in (0, 1)");
}

FlowDepthProblem decide(const Problem& problem, const StartingPoint& start,
                        const JointFlowDepthOptions& options, FlowDepthData& data) {
  FlowDepthProblem out;
  out.start = start.T_curr_prev;
  const NoiseLevels declared = start.errors ? start.errors->levels : declared_levels(problem, options);
  NoiseLevels& levels = out.levels = declared;
  const bool graduated = options.robust == Robust::geman_mcclure_gnc;
  RoughFlowDepthData rough(data);
  // Points behind the camera at the start are always excluded.
  evaluate_points(rough, out.start, {});
  for (size_t i = 0; i < rough.size(); ++i) {
    const bool counts = graduated || (i < start.inliers.size() && start.inliers[i] != 0);
    rough.use(i, counts && std::isfinite(rough.q(i)), false);
  }
  if (rough.n_used() >= min_points) {
    LevelSample sample(rough, start);
    levels = estimate_noise_levels(sample, LevelsOf::inliers, out.start, declared);
    out.start = graduated ? graduate(rough, out.start, levels)
                          : descend(rough, out.start, levels, {Kind::huber, options.huber}, 30).T_curr_prev;
    if (out.start.is_finite()) levels = estimate_noise_levels(sample, LevelsOf::all, out.start, declared);
    if (options.use_depth_curr) {
      levels.delta_d_curr_px = start.errors ? start.errors->levels.delta_d_curr_px
                                            : estimate_delta_d_curr(sample, out.start, levels);
      if (options.plane_radius_px > 0) {
        const std::vector<DepthCurrReading> readings =
            depth_curr_readings(problem, options.plane_radius_px, levels, out.start, rough);
        correct_depth_curr(readings, rough);
        correct_depth_curr(readings, data);
      }
    }
    choose_points_and_kernel(options, rough, out);
  }
  if (rough.n_used() >= min_points) {
    out.prior = weak_directions(rough, start.T_curr_prev, levels, out.kernel);
    // In weakly observable directions the motion at which the points were chosen may be far from the truth.
    if (out.prior.holds() && drop_points(rough, out.prior.mean, levels, options.gate) > 0)
      out.prior = weak_directions(rough, out.prior.mean, levels, out.kernel);
  }
  for (size_t i = 0; i < data.size(); ++i) {
    data.use(i, rough.used(i), rough.uses_depth_curr(i));
    out.inliers.push_back(data.used(i) ? 1 : 0);
  }
  if (data.n_used() < min_points) return out;
  if (out.prior.holds()) out.start = out.prior.mean;
  data.take_depths(rough);
  out.status = Status::ok;
  return out;
}

MotionEstimate JointFlowDepth::estimate(const Problem& problem, const StartingPoint& start) const {
  MotionEstimate estimate = begin_estimate(problem, {});
  if (estimate.status != Status::ok) return estimate;
  FlowDepthData data(problem);
  const FlowDepthProblem decided = decide(problem, start, options_, data);
  estimate.inliers = decided.inliers;
  estimate.status = decided.status;
  if (decided.status != Status::ok) return estimate;
  FlowDepthData points = data.sample(data.size());  // only the included points, contiguous in memory
  const SE3 close = minimize_roughly(points, decided.start, decided.levels, decided.kernel, decided.prior);
  const SolverResult solution =
      minimize_flow_depth(points, close, decided.levels, decided.kernel, options_.solver, decided.prior);
  if (!take_solution(solution, estimate)) return estimate;
  // All points are evaluated again at the end if the correlation is estimated from a sample, or moves the
  // optimum.
  const size_t n_points = points.size();
  const bool samples = options_.covariance == CovarianceOf::correlated && !declares_errors(problem);
  FlowDepthData at_optimum = samples ? points.sample(errors_sample) : std::move(points);
  evaluate_points(at_optimum, solution.T_curr_prev, decided.levels);
  const double inflation =
      decided.kernel.kind == Kind::none ? 1 : std::max(variance_factor(at_optimum, decided.kernel), 1.0);
  const DepthInformation information =
      depth_information(at_optimum, solution.T_curr_prev, decided.levels, {})
          .times(static_cast<double>(n_points) / static_cast<double>(at_optimum.size()));
  conclude(problem, inflation * motion_covariance(information, decided.prior), estimate);
  std::optional<CorrelatedEstimate> correlated;
  if (options_.covariance == CovarianceOf::correlated && estimate.status == Status::ok) {
    correlated = correlate(problem, at_optimum, n_points, decided.levels, decided.kernel, information,
                           inflation, decided.prior.holds(), start.errors.get(), solution.T_curr_prev);
  }
  if (correlated) {
    estimate.T_curr_prev = correlated->T_curr_prev;
    replace_covariance(correlated->covariance, estimate);
    estimate.errors = correlated->errors;
  }
  FlowDepthData& all = samples ? points : at_optimum;
  if (samples || (correlated && correlated->moved))
    evaluate_points(all, estimate.T_curr_prev, decided.levels);
  size_t k = 0;
  for (size_t i = 0; i < data.size(); ++i) {
    if (!data.used(i)) continue;
    estimate.refined_flow_u[i] += (1 - options_.projection_share) * all.error_u(k);
    estimate.refined_flow_v[i] += (1 - options_.projection_share) * all.error_v(k);
    ++k;
  }
  return estimate;
}

}  // namespace sextant
