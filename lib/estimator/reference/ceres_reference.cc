#include "sextant/estimator/reference/ceres_reference.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <memory>

#include "sextant/estimator/solvers/degeneracy.h"

namespace sextant {
namespace {

// Common part of the references: SE(3) as a manifold with left perturbation, and the solver call.

// Ambient parameters of a motion: quaternion x y z w, translation x y z.
using MotionBlock = std::array<double, 7>;

MotionBlock to_block(const SE3& T) {
  const Eigen::Quaterniond& q = T.rotation();
  const Eigen::Vector3d& t = T.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

SE3 from_block(const double* x) {
  return {Eigen::Quaterniond(x[3], x[0], x[1], x[2]), Eigen::Vector3d(x[4], x[5], x[6])};
}

#if CERES_VERSION_MAJOR > 2 || CERES_VERSION_MINOR > 0
using CeresManifold = ceres::Manifold;
constexpr auto manifold_ownership = &ceres::Problem::Options::manifold_ownership;
#else  // Ubuntu 22.04
class CeresManifold : public ceres::LocalParameterization {
 public:
  virtual int AmbientSize() const = 0;
  virtual int TangentSize() const = 0;
  virtual bool PlusJacobian(const double* x, double* jacobian) const = 0;
  virtual bool Minus(const double* y, const double* x, double* y_minus_x) const = 0;
  virtual bool MinusJacobian(const double* x, double* jacobian) const = 0;
  int GlobalSize() const override { return AmbientSize(); }
  int LocalSize() const override { return TangentSize(); }
  bool ComputeJacobian(const double* x, double* jacobian) const override { return PlusJacobian(x, jacobian); }
};
constexpr auto manifold_ownership = &ceres::Problem::Options::local_parameterization_ownership;
#endif

/// SE(3) with left perturbation, as everywhere in this project: plus(T, xi) = exp(xi) T.
class SE3Manifold : public CeresManifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const MotionBlock moved = to_block(SE3::exp(Eigen::Map<const Vector6d>(delta)) * from_block(x));
    std::copy(moved.begin(), moved.end(), x_plus_delta);
    return true;
  }

  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
    const Eigen::Vector3d v(x[0], x[1], x[2]);
    const Eigen::Vector3d t(x[4], x[5], x[6]);
    j.setZero();
    // d (exp(omega) q): vector part (w I - [v]x) / 2, scalar part -v^T / 2
    j.block<3, 3>(0, 3) = 0.5 * (x[3] * Eigen::Matrix3d::Identity() - skew(v));
    j.block<1, 3>(3, 3) = -0.5 * v.transpose();
    j.block<3, 3>(4, 0).setIdentity();
    j.block<3, 3>(4, 3) = -skew(t);
    return true;
  }

  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d>(y_minus_x, 6) = (from_block(y) * from_block(x).inverse()).log();
    return true;
  }

  bool MinusJacobian(const double* x, double* jacobian) const override {
    // Left inverse of PlusJacobian: d omega = 2 (w I + [v]x) d v - 2 v d w; d rho = d t + [t]x d omega.
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
    const Eigen::Vector3d v(x[0], x[1], x[2]);
    const Eigen::Vector3d t(x[4], x[5], x[6]);
    j.setZero();
    j.block<3, 3>(3, 0) = 2.0 * (x[3] * Eigen::Matrix3d::Identity() + skew(v));
    j.block<3, 1>(3, 3) = -2.0 * v;
    j.block<3, 4>(0, 0) = skew(t) * j.block<3, 4>(3, 0);
    j.block<3, 3>(0, 4).setIdentity();
    return true;
  }
};

/// A motion to estimate, with per-point unknowns that are eliminated first (Schur complement). Takes
/// ownership of cost functions, but not of loss functions.
class CeresMotion {
 public:
  CeresMotion(const SE3& start, const SolverOptions& options);

  double* motion() { return motion_.data(); }
  void add(ceres::CostFunction* cost, ceres::LossFunction* loss, auto*... unknowns) {
    problem_.AddResidualBlock(cost, loss, unknowns...);
  }
  void eliminate(double* of_point) { options_.linear_solver_ordering->AddElementToGroup(of_point, 0); }

  /// Solves and fills in everything except the refined flow.
  void solve(const Problem& problem, MotionEstimate& estimate);

 private:
  SE3Manifold manifold_;
  MotionBlock motion_;
  ceres::Problem problem_;
  ceres::Solver::Options options_;
};

ceres::Problem::Options borrow() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.*manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

CeresMotion::CeresMotion(const SE3& start, const SolverOptions& options)
    : motion_(to_block(start)), problem_(borrow()) {
  problem_.AddParameterBlock(motion_.data(), 7, &manifold_);
  options_.max_num_iterations = 10 * options.max_iterations;
  options_.function_tolerance = 1e-18;
  options_.gradient_tolerance = 1e-14;
  options_.parameter_tolerance = 1e-16;
  options_.num_threads = 1;
  options_.logging_type = ceres::SILENT;
  options_.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
}

void CeresMotion::solve(const Problem& problem, MotionEstimate& estimate) {
  const bool has_points = options_.linear_solver_ordering->NumElements() > 0;
  options_.linear_solver_type = has_points ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
  options_.linear_solver_ordering->AddElementToGroup(motion_.data(), 1);
  ceres::Solver::Summary summary;
  ceres::Solve(options_, &problem_, &summary);
  SolverResult solution{.T_curr_prev = from_block(motion_.data()),
                        .iterations = static_cast<int>(summary.iterations.size())};
  solution.at_optimum.cost = summary.IsSolutionUsable() ? summary.final_cost : INFINITY;
  if (!take_solution(solution, estimate)) return;
  ceres::Covariance covariance(ceres::Covariance::Options{});
  const std::vector<std::pair<const double*, const double*>> blocks = {{motion_.data(), motion_.data()}};
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> block;
  block.setConstant(INFINITY);
  if (covariance.Compute(blocks, &problem_)) {
    covariance.GetCovarianceBlockInTangentSpace(motion_.data(), motion_.data(), block.data());
  }
  conclude(problem, block, estimate);
}

/// Residual (p + phihat - project(X m)) / sigma.
struct ProjectionResidual {
  PinholeCamera camera;
  Eigen::Vector3d m;
  double u, v, sigma;

  template <typename T>
  bool operator()(const T* motion, const T* flow, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(motion);
    const Eigen::Matrix<T, 3, 1> p =
        q.normalized() * m.cast<T>() + Eigen::Matrix<T, 3, 1>(motion[4], motion[5], motion[6]);
    if (p[2] <= T(1e-3)) return false;
    residual[0] = (u + flow[0] - (camera.fx * p[0] / p[2] + camera.cx)) / sigma;
    residual[1] = (v + flow[1] - (camera.fy * p[1] / p[2] + camera.cy)) / sigma;
    return true;
  }
};

/// The projection residual with fixed flow.
struct FixedFlowResidual {
  ProjectionResidual projection;
  Eigen::Vector2d flow;

  template <typename T>
  bool operator()(const T* motion, T* residual) const {
    const std::array<T, 2> fixed = {T(flow.x()), T(flow.y())};
    return projection(motion, fixed.data(), residual);
  }
};

/// Residual (phi - phihat) / sigma.
struct FlowResidual {
  double u, v, sigma;
  template <typename T>
  bool operator()(const T* flow, T* residual) const {
    residual[0] = (u - flow[0]) / sigma;
    residual[1] = (v - flow[1]) / sigma;
    return true;
  }
};

ProjectionResidual make_projection(const Problem& problem, size_t i, double sigma_px) {
  const Correspondences& p = problem.points;
  return {problem.camera.left, problem.camera.left.backproject(p.u[i], p.v[i], p.depth[i]), p.u[i], p.v[i],
          sigma_px};
}

double huber_threshold(Robust robust, double huber) {
  if (robust == Robust::geman_mcclure_gnc)
    fail(
        "option robust = geman_mcclure_gnc: expected huber or none for the estimators motion_only_ceres and "
        "joint_flow_ceres");
  return robust == Robust::huber ? huber : 1e100;
}

}  // namespace

MotionEstimate MotionOnlyCeres::estimate(const Problem& problem, const StartingPoint& start) const {
  MotionEstimate estimate = begin_estimate(problem, start.inliers);
  if (estimate.status != Status::ok) return estimate;
  ceres::HuberLoss loss(huber_threshold(options_.robust, options_.huber));
  CeresMotion solver(start.T_curr_prev, options_.solver);
  for (size_t i = 0; i < problem.points.size(); ++i) {
    if (estimate.inliers[i] == 0) continue;
    solver.add(new ceres::AutoDiffCostFunction<FixedFlowResidual, 2, 7>(
                   new FixedFlowResidual{make_projection(problem, i, options_.sigma_px),
                                         {problem.points.flow_u[i], problem.points.flow_v[i]}}),
               &loss, solver.motion());
  }
  solver.solve(problem, estimate);
  return estimate;
}

MotionEstimate JointFlowCeres::estimate(const Problem& problem, const StartingPoint& start) const {
  MotionEstimate estimate = begin_estimate(problem, start.inliers);
  if (estimate.status != Status::ok) return estimate;
  ceres::HuberLoss projection_loss(huber_threshold(options_.robust, options_.huber_projection));
  ceres::HuberLoss flow_loss(huber_threshold(options_.robust, options_.huber_flow));
  std::vector<std::array<double, 2>> flows(problem.points.size());
  CeresMotion solver(start.T_curr_prev, options_.solver);
  for (size_t i = 0; i < problem.points.size(); ++i) {
    if (estimate.inliers[i] == 0) continue;
    const double u = problem.points.flow_u[i];
    const double v = problem.points.flow_v[i];
    flows[i] = {u, v};
    solver.add(new ceres::AutoDiffCostFunction<ProjectionResidual, 2, 7, 2>(
                   new ProjectionResidual(make_projection(problem, i, options_.sigma_projection_px))),
               &projection_loss, solver.motion(), flows[i].data());
    solver.add(
        new ceres::AutoDiffCostFunction<FlowResidual, 2, 2>(new FlowResidual{u, v, options_.sigma_flow_px}),
        &flow_loss, flows[i].data());
    solver.eliminate(flows[i].data());
  }
  solver.solve(problem, estimate);
  for (size_t i = 0; i < flows.size(); ++i) {
    if (estimate.inliers[i] == 0) continue;
    estimate.refined_flow_u[i] = flows[i][0];
    estimate.refined_flow_v[i] = flows[i][1];
  }
  return estimate;
}

namespace {

struct PointResidual {
  PinholeCamera camera;
  Eigen::Vector3d ray;
  double u, v, flow_u, flow_v;
  double weight_projection_u, weight_projection_v, weight_flow_u, weight_flow_v;
  PointDepths depths;
  DepthErrors noise;

  template <typename T>
  T depth_residual(const T& inverse_depth, double measured, double weight) const {
    const T r = (inverse_depth - measured) * weight;
    if (noise == DepthErrors::disparity) return r;
    return r * sqrt((2.0 * inverse_depth + measured) / (3.0 * measured));
  }

  /// point = refined flow (px), depth (m)
  template <typename T>
  bool operator()(const T* motion, const T* point, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(motion);
    const T& z = point[2];
    if (z <= T(1e-3)) return false;
    const Eigen::Matrix<T, 3, 1> m = ray.cast<T>() * z;
    const Eigen::Matrix<T, 3, 1> p =
        q.normalized() * m + Eigen::Matrix<T, 3, 1>(motion[4], motion[5], motion[6]);
    if (p[2] <= T(1e-3)) return false;
    residual[0] = (u + point[0] - (camera.fx * p[0] / p[2] + camera.cx)) * weight_projection_u;
    residual[1] = (v + point[1] - (camera.fy * p[1] / p[2] + camera.cy)) * weight_projection_v;
    residual[2] = (flow_u - point[0]) * weight_flow_u;
    residual[3] = (flow_v - point[1]) * weight_flow_v;
    residual[4] = depth_residual(T(1.0 / z), depths.inverse_depth, depths.weight);
    residual[5] = depth_residual(T(1.0 / p[2]), depths.inverse_depth_curr, depths.weight_curr);
    return true;
  }
};

class GemanMcClureLoss : public ceres::LossFunction {
 public:
  explicit GemanMcClureLoss(const RobustKernel& kernel) : kernel_(kernel) {}
  void Evaluate(double q, double rho[3]) const override {
    rho[0] = kernel_.cost(q);
    rho[1] = kernel_.weight(q);
    rho[2] = kernel_.weight_slope(q);
  }

 private:
  RobustKernel kernel_;
};

std::unique_ptr<ceres::LossFunction> make_loss(const RobustKernel& kernel) {
  switch (kernel.kind) {
    case RobustKernel::Kind::huber:
      return std::make_unique<ceres::HuberLoss>(kernel.scale);
    case RobustKernel::Kind::geman_mcclure:
      return std::make_unique<GemanMcClureLoss>(kernel);
    case RobustKernel::Kind::none:
      break;
  }
  return nullptr;
}

/// The prior of flow_depth_solver.h, with the precision as U^T U.
struct PriorResidual {
  SE3 mean;
  Matrix6d U;

  template <typename T>
  bool operator()(const T* motion, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> rotation(motion);
    const Eigen::Quaternion<T> q = rotation.normalized() * mean.rotation().conjugate().cast<T>();
    const Eigen::Matrix<T, 3, 1> t_mean = mean.translation().cast<T>();
    Eigen::Matrix<T, 6, 1> xi;
    xi.template tail<3>() = T(2) * q.vec();
    xi.template head<3>() = Eigen::Matrix<T, 3, 1>(motion[4], motion[5], motion[6]) - t_mean +
                            t_mean.cross(xi.template tail<3>());
    Eigen::Map<Eigen::Matrix<T, 6, 1>>(residual, 6) = U.cast<T>() * xi;
    return true;
  }
};

PointResidual make_residual(const Problem& problem, size_t i, const NoiseLevels& levels,
                            const FlowDepthData& data, double projection_share) {
  const Correspondences& p = problem.points;
  const double projection = std::sqrt(projection_share);
  const double flow = std::sqrt(1 - projection_share);
  return {problem.camera.left,
          problem.camera.left.ray(p.u[i], p.v[i]),
          p.u[i],
          p.v[i],
          p.flow_u[i],
          p.flow_v[i],
          1 / (projection * levels.sigma_flow_u_px),
          1 / (projection * levels.sigma_flow_v_px),
          1 / (flow * levels.sigma_flow_u_px),
          1 / (flow * levels.sigma_flow_v_px),
          data.depths(i, levels),
          levels.depth_noise};
}

}  // namespace

MotionEstimate JointFlowDepthCeres::estimate(const Problem& problem, const StartingPoint& start) const {
  MotionEstimate estimate = begin_estimate(problem, {});
  if (estimate.status != Status::ok) return estimate;
  FlowDepthData data(problem);
  const FlowDepthProblem decided = decide(problem, start, options_, data);
  estimate.inliers = decided.inliers;
  estimate.status = decided.status;
  if (decided.status != Status::ok) return estimate;

  const std::unique_ptr<ceres::LossFunction> loss = make_loss(decided.kernel);
  std::vector<std::array<double, 3>> points(problem.points.size());
  CeresMotion solver(decided.start, options_.solver);
  for (size_t i = 0; i < points.size(); ++i) {
    if (!data.used(i)) continue;
    auto residual = std::make_unique<PointResidual>(
        make_residual(problem, i, decided.levels, data, options_.projection_share));
    points[i] = {problem.points.flow_u[i], problem.points.flow_v[i], 1 / residual->depths.inverse_depth};
    solver.add(new ceres::AutoDiffCostFunction<PointResidual, 6, 7, 3>(residual.release()), loss.get(),
               solver.motion(), points[i].data());
    solver.eliminate(points[i].data());
  }
  if (decided.prior.holds()) {
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(decided.prior.precision);
    const Matrix6d U =
        eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
    solver.add(new ceres::AutoDiffCostFunction<PriorResidual, 6, 7>(new PriorResidual{decided.prior.mean, U}),
               nullptr, solver.motion());
  }
  solver.solve(problem, estimate);
  for (size_t i = 0; i < points.size(); ++i) {
    if (!data.used(i)) continue;
    estimate.refined_flow_u[i] = points[i][0];
    estimate.refined_flow_v[i] = points[i][1];
  }
  return estimate;
}

}  // namespace sextant
