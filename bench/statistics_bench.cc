// Time of quantiles of distributions, ours and Boost's, and of an interval that needs five quantiles.

#include <benchmark/benchmark.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <random>

#include "sextant/stats/bootstrap.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {
namespace {

/// Calls quantile(p) for p across 0..1.
void run(benchmark::State& state, const auto& quantile) {
  double p = 0.0005;
  for (auto _ : state) {
    benchmark::DoNotOptimize(quantile(p));
    p = p < 0.999 ? p + 0.001 : 0.0005;
  }
}

void normal(benchmark::State& state) { run(state, normal_quantile); }
void chi_square(benchmark::State& state) {
  run(state, [&](double p) { return chi_square_quantile(p, static_cast<double>(state.range(0))); });
}
void student_t(benchmark::State& state) {
  run(state, [&](double p) { return student_t_quantile(p, static_cast<int>(state.range(0))); });
}
void normal_boost(benchmark::State& state) {
  run(state, [](double p) { return boost::math::quantile(boost::math::normal(), p); });
}
void chi_square_boost(benchmark::State& state) {
  const boost::math::chi_squared distribution(static_cast<double>(state.range(0)));
  run(state, [&](double p) { return boost::math::quantile(distribution, p); });
}
void student_t_boost(benchmark::State& state) {
  const boost::math::students_t distribution(static_cast<double>(state.range(0)));
  run(state, [&](double p) { return boost::math::quantile(distribution, p); });
}

void bootstrap_of_a_mean(benchmark::State& state) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> noise;
  std::vector<double> values;
  for (int i = 0; i < 20; ++i) values.push_back(noise(engine));
  for (auto _ : state) benchmark::DoNotOptimize(bootstrap(values, mean));
}

BENCHMARK(normal);
BENCHMARK(normal_boost);
BENCHMARK(chi_square)->Arg(6)->Arg(600);
BENCHMARK(chi_square_boost)->Arg(6)->Arg(600);
BENCHMARK(student_t)->Arg(4)->Arg(19);
BENCHMARK(student_t_boost)->Arg(4)->Arg(19);
BENCHMARK(bootstrap_of_a_mean)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace sextant
