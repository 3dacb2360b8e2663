#include "sextant/estimator/ceres_reference.h"

#include <ceres/ceres.h>

#include <array>

namespace sextant {
namespace {

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

/// SE(3) with left perturbation, as everywhere in this project: plus(T, xi) = exp(xi) T.
class SE3Manifold : public ceres::Manifold {
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

/// (p + phihat - project(X m)) / sigma
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

/// The same with the flow fixed.
struct FixedFlowResidual {
  ProjectionResidual projection;
  Eigen::Vector2d flow;

  template <typename T>
  bool operator()(const T* motion, T* residual) const {
    const std::array<T, 2> fixed = {T(flow.x()), T(flow.y())};
    return projection(motion, fixed.data(), residual);
  }
};

/// (phi - phihat) / sigma
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

ceres::Solver::Options solver_options(const SolverOptions& options) {
  ceres::Solver::Options ceres_options;
  ceres_options.max_num_iterations = 10 * options.max_iterations;
  ceres_options.function_tolerance = 1e-18;
  ceres_options.gradient_tolerance = 1e-14;
  ceres_options.parameter_tolerance = 1e-16;
  ceres_options.num_threads = 1;
  ceres_options.logging_type = ceres::SILENT;
  return ceres_options;
}

/// A problem that owns nothing but its residual blocks.
ceres::Problem::Options borrow() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

MotionEstimate prepare(const Problem& problem, const StartingPoint& start) {
  MotionEstimate estimate;
  estimate.inliers = start.inliers;
  estimate.refined_flow_u = problem.points.flow_u;
  estimate.refined_flow_v = problem.points.flow_v;
  const auto n =
      std::count_if(start.inliers.begin(), start.inliers.end(), [](unsigned char k) { return k != 0; });
  if (n < 3) estimate.status = Status::too_few_points;
  return estimate;
}

void solve(ceres::Problem& problem, const ceres::Solver::Options& options, MotionBlock& motion,
           MotionEstimate& estimate) {
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  estimate.T_curr_prev = from_block(motion.data());
  estimate.iterations = static_cast<int>(summary.iterations.size());
  estimate.cost = summary.final_cost;
  if (!summary.IsSolutionUsable() || !estimate.T_curr_prev.is_finite()) return;
  ceres::Covariance covariance(ceres::Covariance::Options{});
  const std::vector<std::pair<const double*, const double*>> blocks = {{motion.data(), motion.data()}};
  if (!covariance.Compute(blocks, &problem)) return;
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> block;
  covariance.GetCovarianceBlockInTangentSpace(motion.data(), motion.data(), block.data());
  estimate.covariance = block;
  estimate.status = Status::ok;
}

}  // namespace

MotionEstimate MotionOnlyCeres::estimate(const Problem& problem, const StartingPoint& start) const {
  MotionEstimate estimate = prepare(problem, start);
  if (estimate.status == Status::too_few_points) return estimate;
  ceres::HuberLoss loss(options_.huber);
  SE3Manifold manifold;
  MotionBlock motion = to_block(start.T_curr_prev);
  ceres::Problem ceres_problem(borrow());
  ceres_problem.AddParameterBlock(motion.data(), 7, &manifold);
  for (size_t i = 0; i < problem.points.size(); ++i) {
    if (start.inliers[i] == 0) continue;
    ceres_problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<FixedFlowResidual, 2, 7>(
            new FixedFlowResidual{make_projection(problem, i, options_.sigma_px),
                                  {problem.points.flow_u[i], problem.points.flow_v[i]}}),
        &loss, motion.data());
  }
  ceres::Solver::Options options = solver_options(options_.solver);
  options.linear_solver_type = ceres::DENSE_QR;
  solve(ceres_problem, options, motion, estimate);
  return estimate;
}

MotionEstimate JointFlowCeres::estimate(const Problem& problem, const StartingPoint& start) const {
  MotionEstimate estimate = prepare(problem, start);
  if (estimate.status == Status::too_few_points) return estimate;
  ceres::HuberLoss projection_loss(options_.huber_projection);
  ceres::HuberLoss flow_loss(options_.huber_flow);
  SE3Manifold manifold;
  MotionBlock motion = to_block(start.T_curr_prev);
  std::vector<std::array<double, 2>> flows(problem.points.size());
  ceres::Problem ceres_problem(borrow());
  ceres_problem.AddParameterBlock(motion.data(), 7, &manifold);
  ceres::Solver::Options options = solver_options(options_.solver);
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (size_t i = 0; i < problem.points.size(); ++i) {
    if (start.inliers[i] == 0) continue;
    const double u = problem.points.flow_u[i];
    const double v = problem.points.flow_v[i];
    flows[i] = {u, v};
    ceres_problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<ProjectionResidual, 2, 7, 2>(
            new ProjectionResidual(make_projection(problem, i, options_.sigma_projection_px))),
        &projection_loss, motion.data(), flows[i].data());
    ceres_problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<FlowResidual, 2, 2>(new FlowResidual{u, v, options_.sigma_flow_px}),
        &flow_loss, flows[i].data());
    options.linear_solver_ordering->AddElementToGroup(flows[i].data(), 0);
  }
  options.linear_solver_ordering->AddElementToGroup(motion.data(), 1);
  solve(ceres_problem, options, motion, estimate);
  for (size_t i = 0; i < flows.size(); ++i) {
    if (start.inliers[i] == 0) continue;
    estimate.refined_flow_u[i] = flows[i][0];
    estimate.refined_flow_v[i] = flows[i][1];
  }
  return estimate;
}

}  // namespace sextant
