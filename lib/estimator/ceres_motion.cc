#include "sextant/estimator/ceres_motion.h"

namespace sextant {

ceres::Solver::Options ceres_solver_options(const SolverOptions& options) {
  ceres::Solver::Options ceres_options;
  ceres_options.max_num_iterations = 10 * options.max_iterations;
  ceres_options.function_tolerance = 1e-18;
  ceres_options.gradient_tolerance = 1e-14;
  ceres_options.parameter_tolerance = 1e-16;
  ceres_options.num_threads = 1;
  ceres_options.logging_type = ceres::SILENT;
  return ceres_options;
}

ceres::Problem::Options borrow() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
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

}  // namespace sextant
