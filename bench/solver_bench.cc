// The solver and the robust start on random problems; ours and Ceres on identical instances in one run.

#include <benchmark/benchmark.h>

#include "sextant/estimator/estimator.h"
#include "sextant/estimator/reprojection_solver.h"
#include "sextant/estimator/robust_start.h"
#include "sextant/estimator/testing.h"

namespace sextant {
namespace {

testing::RandomProblem instance(int n_points, double outlier_share) {
  return testing::make_random_problem(1, {.n_points = n_points, .outlier_share = outlier_share});
}

void estimate(benchmark::State& state, const char* name) {
  const testing::RandomProblem random = instance(static_cast<int>(state.range(0)), 0.1);
  const std::unique_ptr<Estimator> estimator = make_estimator(name);
  int iterations = 0;
  for (auto _ : state) {
    const MotionEstimate estimate = estimator->estimate(random.problem, random.start);
    iterations = estimate.iterations;
    benchmark::DoNotOptimize(estimate.cost);
  }
  state.counters["solver_iterations"] = iterations;
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void accumulate_points(benchmark::State& state) {
  const testing::RandomProblem random = instance(static_cast<int>(state.range(0)), 0.1);
  const ReprojectionData data(random.problem, {});
  for (auto _ : state) {
    benchmark::DoNotOptimize(accumulate(data, random.start.T_curr_prev, {0.9, 1.0}));
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void ransac(benchmark::State& state) {
  const testing::RandomProblem random =
      instance(static_cast<int>(state.range(0)), static_cast<double>(state.range(1)) / 100);
  int iterations = 0;
  for (auto _ : state) {
    const RobustStart start = robust_start(random.problem, std::nullopt, {});
    iterations = start.iterations;
    benchmark::DoNotOptimize(start.n_inliers);
  }
  state.counters["samples"] = iterations;
}

BENCHMARK_CAPTURE(estimate, motion_only, "motion_only")->Arg(100)->Arg(3000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(estimate, motion_only_ceres, "motion_only_ceres")
    ->Arg(100)
    ->Arg(3000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(estimate, joint_flow, "joint_flow")->Arg(100)->Arg(3000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(estimate, joint_flow_ceres, "joint_flow_ceres")
    ->Arg(100)
    ->Arg(3000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(accumulate_points)->Arg(3000)->Unit(benchmark::kMicrosecond);
BENCHMARK(ransac)->Args({3000, 10})->Args({3000, 30})->Args({3000, 50})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace sextant
