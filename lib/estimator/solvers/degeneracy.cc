#include "sextant/estimator/solvers/degeneracy.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"

namespace sextant {
namespace {

constexpr int min_points = 3;
constexpr double usual_delta_d_px = 0.2;
constexpr double significant = 3;  // in units of kappa
constexpr double line_rms_px = 0.5;
constexpr double affine_rms = 2;            // in units of kappa
constexpr double max_turn_rad = 0.25;       // standard deviation
constexpr double max_relative_shift = 0.5;  // standard deviation over distance
constexpr double max_condition = 1e14;      // above this value rounding errors dominate

bool kept(const std::vector<unsigned char>& keep, size_t i) { return keep.empty() || keep[i] != 0; }

double inverse_depth_sigma(const Problem& problem) {
  if (problem.noise && problem.noise->inverse_depth_per_m > 0) return problem.noise->inverse_depth_per_m;
  return problem.camera.bf > 0 ? usual_delta_d_px / problem.camera.bf : 0;
}

/// First and second moments of pixels, relative to the first point.
struct Moments {
  double n = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0;

  void add(double du, double dv) {
    n += 1, u += du, v += dv;
    uu += du * du, uv += du * dv, vv += dv * dv;
  }
  double covariance(double ab, double a, double b) const { return ab / n - a / n * (b / n); }
};

/// `for_each(add)` calls add(du, dv, ds) for each point: pixel and inverse depth relative to the first one.
template <typename ForEach>
bool is_line(const Moments& m, double kappa, const ForEach& for_each) {
  const double uu = m.covariance(m.uu, m.u, m.u);
  const double uv = m.covariance(m.uv, m.u, m.v);
  const double vv = m.covariance(m.vv, m.v, m.v);
  const double half = 0.5 * (uu - vv);
  const double root = std::hypot(half, uv);
  const double along = 0.5 * (uu + vv) + root;
  const double across = 0.5 * (uu + vv) - root;
  constexpr double line2 = line_rms_px * line_rms_px;
  if (!(across <= line2)) return false;
  if (along <= line2) return true;
  const double angle = 0.5 * std::atan2(uv, half);
  double s = 0, us = 0, vs = 0, ss = 0;
  for_each([&](double du, double dv, double ds) { s += ds, us += du * ds, vs += dv * ds, ss += ds * ds; });
  const double ts = std::cos(angle) * m.covariance(us, m.u, s) + std::sin(angle) * m.covariance(vs, m.v, s);
  const double rest = m.covariance(ss, s, s) - ts * ts / along;
  const double rounding = 1e-12 * ss / m.n;
  return rest <= affine_rms * affine_rms * kappa * kappa + rounding;
}

/// Returns the ratio of the largest to the smallest eigenvalue; nullopt unless the matrix is positive
/// definite beyond rounding.
std::optional<double> condition_of(const Matrix6d& m) {
  if (!m.allFinite()) return std::nullopt;
  const auto eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix6d>(m, Eigen::EigenvaluesOnly).eigenvalues();
  if (!(eigenvalues[0] * max_condition > eigenvalues[5])) return std::nullopt;
  return eigenvalues[5] / eigenvalues[0];
}

/// Returns true if the standard deviations of the rotation or of the position of the points' centre are too
/// large.
bool leaves_open(const Problem& problem, const Matrix6d& covariance, const MotionEstimate& estimate) {
  const Correspondences& p = problem.points;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  int n = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    if (estimate.inliers[i] == 0) continue;
    centre += problem.camera.left.backproject(p.u[i], p.v[i], p.depth[i]);
    ++n;
  }
  centre = estimate.T_curr_prev * (centre / n);
  Eigen::Matrix<double, 3, 6> shift;  // derivative of the centre with respect to the left twist
  shift << Eigen::Matrix3d::Identity(), -skew(centre);
  const auto largest = [](const Eigen::Matrix3d& m) {
    return std::sqrt(
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m, Eigen::EigenvaluesOnly).eigenvalues()[2]);
  };
  const double turn_rad = largest(covariance.bottomRightCorner<3, 3>());
  const double shift_m = largest(shift * covariance * shift.transpose());
  return !(turn_rad <= max_turn_rad && shift_m <= max_relative_shift * centre.norm());
}

}  // namespace

Status check_geometry(const Problem& problem, const std::vector<unsigned char>& keep) {
  const Correspondences& p = problem.points;
  SEXTANT_CHECK(keep.empty() || keep.size() == p.size());
  const double kappa = inverse_depth_sigma(problem);
  Moments moments;
  size_t first = 0;
  double nearest_m = INFINITY;
  int infinitely_far = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    if (!kept(keep, i)) continue;
    if (!p.is_measurement(i)) {
      if (p.has_pixels(i) && p.depth[i] == INFINITY) ++infinitely_far;
      continue;
    }
    if (moments.n == 0) first = i;
    moments.add(p.u[i] - p.u[first], p.v[i] - p.v[first]);
    nearest_m = std::min(nearest_m, p.depth[i]);
  }
  if (moments.n + infinitely_far < min_points) return Status::too_few_points;
  if (1 / nearest_m <= significant * kappa) return Status::at_infinity;
  if (moments.n < min_points) return Status::too_few_points;
  const auto for_each = [&](const auto& add) {
    for (size_t i = first; i < p.size(); ++i) {
      if (kept(keep, i) && p.is_measurement(i))
        add(p.u[i] - p.u[first], p.v[i] - p.v[first], 1 / p.depth[i] - 1 / p.depth[first]);
    }
  };
  return is_line(moments, kappa, for_each) ? Status::collinear : Status::ok;
}

MotionEstimate begin_estimate(const Problem& problem, const std::vector<unsigned char>& keep) {
  const Correspondences& p = problem.points;
  MotionEstimate estimate;
  estimate.status = check_geometry(problem, keep);
  estimate.refined_flow_u = p.flow_u;
  estimate.refined_flow_v = p.flow_v;
  estimate.inliers.resize(p.size());
  for (size_t i = 0; i < p.size(); ++i) estimate.inliers[i] = kept(keep, i) && p.is_measurement(i) ? 1 : 0;
  return estimate;
}

bool take_solution(const SolverResult& solution, MotionEstimate& estimate) {
  estimate.status = Status::diverged;
  if (!std::isfinite(solution.at_optimum.cost) || !solution.T_curr_prev.is_finite()) return false;
  estimate.T_curr_prev = solution.T_curr_prev;
  estimate.iterations = solution.iterations;
  estimate.cost = solution.at_optimum.cost;
  return true;
}

void conclude(const Problem& problem, const Matrix6d& covariance, MotionEstimate& estimate) {
  estimate.status = check_geometry(problem, estimate.inliers);
  bool open = true;
  if (const auto condition = condition_of(covariance)) {
    estimate.covariance = covariance;
    estimate.condition = *condition;
    open = leaves_open(problem, covariance, estimate);
  }
  if (estimate.status == Status::ok && open) estimate.status = Status::no_parallax;
}

void replace_covariance(const Matrix6d& covariance, MotionEstimate& estimate) {
  const auto condition = condition_of(covariance);
  if (!condition) {
    if (estimate.status == Status::ok) estimate.status = Status::no_parallax;
    return;
  }
  estimate.covariance = covariance;
  estimate.condition = *condition;
}

void conclude(const Problem& problem, const Matrix6d& hessian, double variance_factor,
              MotionEstimate& estimate) {
  Matrix6d covariance = Matrix6d::Constant(INFINITY);
  if (condition_of(hessian)) covariance = variance_factor * hessian.ldlt().solve(Matrix6d::Identity());
  conclude(problem, covariance, estimate);
}

}  // namespace sextant
