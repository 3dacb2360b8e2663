#include "sextant/estimator/reference/ceres_flow_depth.h"

#include <Eigen/Eigenvalues>
#include <memory>

#include "sextant/estimator/reference/ceres_motion.h"

namespace sextant {
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

/// motion_prior.h, with the precision as U^T U.
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
