#include "sextant/estimator/reference/ceres_reference.h"

#include <ceres/ceres.h>

#include <array>

#include "sextant/estimator/reference/ceres_motion.h"

namespace sextant {
namespace {

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

double huber_threshold(Robust robust, double huber) {
  if (robust == Robust::geman_mcclure_gnc)
    fail(
        "option robust = geman_mcclure_gnc: the Ceres references of motion_only and joint_flow have huber and none");
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

}  // namespace sextant
