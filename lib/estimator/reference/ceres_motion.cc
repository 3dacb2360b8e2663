#include "sextant/estimator/reference/ceres_motion.h"

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

void solve(ceres::Problem& ceres_problem, const ceres::Solver::Options& options, const Problem& problem,
           MotionBlock& motion, MotionEstimate& estimate) {
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  SolverResult solution;
  solution.T_curr_prev = from_block(motion.data());
  solution.iterations = static_cast<int>(summary.iterations.size());
  solution.at_optimum.cost = summary.IsSolutionUsable() ? summary.final_cost : INFINITY;
  if (!take_solution(solution, estimate)) return;
  ceres::Covariance covariance(ceres::Covariance::Options{});
  const std::vector<std::pair<const double*, const double*>> blocks = {{motion.data(), motion.data()}};
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> block;
  block.setConstant(INFINITY);
  if (covariance.Compute(blocks, &ceres_problem)) {
    covariance.GetCovarianceBlockInTangentSpace(motion.data(), motion.data(), block.data());
  }
  conclude(problem, block, estimate);
}

}  // namespace sextant
