// Times of the estimators and the robust start on random problems; our estimators against their references in
// Ceres, on identical problems in one run.

#include <benchmark/benchmark.h>
#include <Eigen/Dense>

#include <ctime>

#include "sextant/base/quantile.h"
#include "sextant/estimator/flow_depth/correlated_errors.h"
#include "sextant/estimator/flow_depth/correlated_weights.h"
#include "sextant/estimator/flow_depth/joint_flow_depth.h"
#include "sextant/estimator/registry.h"
#include "sextant/estimator/solvers/reprojection_solver.h"
#include "sextant/estimator/solvers/testing.h"
#include "sextant/estimator/start/robust_start.h"

namespace sextant {
namespace {

RandomProblem instance(int n_points, double outlier_share) {
  return make_random_problem(
      1, {.n_points = n_points, .outlier_share = outlier_share, .delta_d_px = 0.1, .depth_curr = true});
}

/// Returns the processor time of the calling thread. Both sides use one thread; other processes do not count.
double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Returns the time of one refinement; every call uses the same points and the same start.
double solve_ms(const Estimator& estimator, const RandomProblem& random, MotionEstimate& estimate) {
  const double start = thread_ms();
  estimate = estimator.estimate(random.problem, random.start);
  return thread_ms() - start;
}

void estimate(benchmark::State& state, const char* name) {
  const RandomProblem random = instance(static_cast<int>(state.range(0)), 0.1);
  const std::unique_ptr<Estimator> estimator = make_estimator(name);
  MotionEstimate estimate;
  for (auto _ : state) solve_ms(*estimator, random, estimate);
  state.counters["solver_iterations"] = estimate.iterations;
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

/// Runs our estimator and its reference in Ceres alternately. Reports the differences of cost and pose, and
/// the ratio of their median times. For joint_flow_depth, `decide_ms` is the time that both spend on the
/// choice of points, noise levels and kernel; `ratio_solve` is the ratio without it.
void against_ceres(benchmark::State& state, const char* name, const Json& options) {
  const RandomProblem random = instance(static_cast<int>(state.range(0)), 0.1);
  const std::unique_ptr<Estimator> ours = make_estimator(name, options);
  const std::unique_ptr<Estimator> reference = make_estimator(std::string(name) + "_ceres", options);
  const bool decides = std::string_view(name) == "joint_flow_depth";
  JointFlowDepthOptions decide_options;
  if (decides) read_options(options, decide_options);
  MotionEstimate fast, slow;
  std::vector<double> fast_ms, slow_ms, decide_ms;
  for (auto _ : state) {
    for (int k = 0; k < 10; ++k) fast_ms.push_back(solve_ms(*ours, random, fast));
    slow_ms.push_back(solve_ms(*reference, random, slow));
    for (int k = 0; decides && k < 10; ++k) {
      const double start = thread_ms();
      FlowDepthData data(random.problem);
      benchmark::DoNotOptimize(decide(random.problem, random.start, decide_options, data).status);
      decide_ms.push_back(thread_ms() - start);
    }
  }
  const double ours_ms = upper_median(fast_ms);
  const double ceres_ms = upper_median(slow_ms);
  state.counters["ours_ms"] = ours_ms;
  state.counters["ceres_ms"] = ceres_ms;
  state.counters["ratio"] = ceres_ms / ours_ms;
  if (decides) {
    const double both_ms = upper_median(decide_ms);
    state.counters["decide_ms"] = both_ms;
    state.counters["ratio_solve"] = (ceres_ms - both_ms) / (ours_ms - both_ms);
  }
  state.counters["pose_difference"] = pose_difference(fast.T_curr_prev, slow.T_curr_prev);
  state.counters["cost_difference"] = std::abs(fast.cost - slow.cost) / slow.cost;
}

void accumulate_points(benchmark::State& state) {
  const RandomProblem random = instance(static_cast<int>(state.range(0)), 0.1);
  const ReprojectionData data(random.problem);
  for (auto _ : state) {
    benchmark::DoNotOptimize(accumulate(data, random.start.T_curr_prev, {0.9, 1.0}));
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void ransac(benchmark::State& state) {
  const RandomProblem random =
      instance(static_cast<int>(state.range(0)), static_cast<double>(state.range(1)) / 100);
  int iterations = 0;
  for (auto _ : state) {
    const RobustStart start = robust_start(random.problem, std::nullopt, {});
    iterations = start.iterations;
    benchmark::DoNotOptimize(start.n_inliers);
  }
  state.counters["samples"] = iterations;
}

/// Solves normal equations of the size of those of smooth errors (correlated_weights.h) with our solver and
/// with Eigen's in turns.
void cholesky(benchmark::State& state) {
  const auto n = static_cast<size_t>(state.range(0));
  const auto size = static_cast<Eigen::Index>(n);
  constexpr size_t n_right = ErrorScore::n_unknowns;
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(size, size);
  const Eigen::MatrixXd A = root * root.transpose() + Eigen::MatrixXd::Identity(size, size);
  const Eigen::MatrixXd B = Eigen::MatrixXd::Random(size, n_right);
  std::vector<double> ours_ms, eigen_ms;
  double difference = 0;
  for (auto _ : state) {
    PositiveDefiniteSystem system(n);
    for (size_t column = 0; column < n; ++column) {
      for (size_t row = column; row < n; ++row) system.left(row, column) = A.data()[column * n + row];
      for (size_t side = 0; side < n_right; ++side) system.right(column, side) = B.data()[side * n + column];
    }
    double start = thread_ms();
    benchmark::DoNotOptimize(system.solve());
    ours_ms.push_back(thread_ms() - start);
    start = thread_ms();
    const Eigen::MatrixXd X = A.llt().solve(B);
    eigen_ms.push_back(thread_ms() - start);
    for (size_t row = 0; row < n; ++row)
      difference = std::max(difference, std::abs(system.right(row, 0) - X.data()[row]));
  }
  state.counters["ratio"] = upper_median(eigen_ms) / upper_median(ours_ms);
  state.counters["difference"] = difference;
}

BENCHMARK_CAPTURE(estimate, motion_only, "motion_only")->Arg(100)->Arg(3000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(estimate, joint_flow, "joint_flow")->Arg(100)->Arg(3000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(estimate, joint_flow_depth, "joint_flow_depth")
    ->Arg(100)
    ->Arg(3000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(against_ceres, motion_only, "motion_only", Json::object())->Arg(3000)->Iterations(9);
BENCHMARK_CAPTURE(against_ceres, joint_flow, "joint_flow", Json::object())->Arg(3000)->Iterations(9);
const Json precise = {{"step_tolerance", 1e-9}};  // both to the same precision, not to the default of ours
BENCHMARK_CAPTURE(against_ceres, joint_flow_depth, "joint_flow_depth", Json{{"solver", precise}})
    ->Arg(3000)
    ->Iterations(9);
BENCHMARK_CAPTURE(against_ceres, joint_flow_depth_huber, "joint_flow_depth",
                  Json{{"robust", "huber"}, {"solver", precise}})
    ->Arg(3000)
    ->Iterations(9);
BENCHMARK_CAPTURE(against_ceres, joint_flow_depth_previous_depth, "joint_flow_depth",
                  Json{{"use_depth_curr", false}, {"solver", precise}})
    ->Arg(3000)
    ->Iterations(9);
BENCHMARK(cholesky)->Arg(24)->Arg(96)->Iterations(2000)->Unit(benchmark::kMicrosecond);
BENCHMARK(accumulate_points)->Arg(3000)->Unit(benchmark::kMicrosecond);
BENCHMARK(ransac)->Args({3000, 10})->Args({3000, 30})->Args({3000, 50})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace sextant
