#include "sextant/estimator/reference/ceres_motion.h"

namespace sextant {

namespace {

ceres::Problem::Options borrow() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.*manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

}  // namespace

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

}  // namespace sextant
