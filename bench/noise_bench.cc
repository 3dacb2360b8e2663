// Random numbers per second: normals as a function of the pixel (noise/draws.h), compared with a sequential
// generator.

#include <benchmark/benchmark.h>

#include <random>

#include "sextant/noise/draws.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

struct Row {
  std::vector<int> x, y;
  std::vector<double> first, second;
  explicit Row(int n) : y(n, 100), first(n), second(n) {
    for (int i = 0; i < n; ++i) x.push_back(i);
  }
};

// Each call yields two normals, and both are counted: a flow needs two, a depth one.
void normals_in_batches(benchmark::State& state) {
  Row row(static_cast<int>(state.range(0)));
  const Draws draws(1, "vdo", "0003");
  int frame = 0;
  for (auto _ : state) {
    draws.normals(NoiseChannel::flow, {frame++, row.x, row.y}, Correlation::independent, row.first,
                  row.second);
    benchmark::DoNotOptimize(row.first.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * 2 * state.range(0));
}

/// Correlation similar to that of a network's errors.
const NoiseCorrelation spatial(SpatialCorrelation{{{5, 0.4}, {40, 0.5}}});

void correlated_normals(benchmark::State& state, Row row) {
  const Draws draws(1, "vdo", "0003");
  int frame = 0;
  for (auto _ : state) {
    spatial.normals(draws, NoiseChannel::flow, {frame++, row.x, row.y}, row.first, row.second);
    benchmark::DoNotOptimize(row.first.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * 2 * static_cast<int64_t>(row.x.size()));
}

void correlated_normals_of_a_row(benchmark::State& state) { correlated_normals(state, Row(1242)); }

/// Draws correlated normals at 4000 pixels that are spread over an image.
void correlated_normals_of_features(benchmark::State& state) {
  Row row(4000);
  std::mt19937 random(1);
  for (int& x : row.x) x = static_cast<int>(random() % 1242);
  for (int& y : row.y) y = static_cast<int>(random() % 375);
  correlated_normals(state, row);
}

void normals_one_by_one(benchmark::State& state) {
  const Draws draws(1, "vdo", "0003");
  int x = 0;
  for (auto _ : state) benchmark::DoNotOptimize(draws.normals(NoiseChannel::flow, 3, x++, 100));
  state.SetItemsProcessed(state.iterations() * 2);
}

void uniforms_in_batches(benchmark::State& state) {
  Row row(static_cast<int>(state.range(0)));
  const Draws draws(1, "vdo", "0003");
  int frame = 0;
  for (auto _ : state) {
    draws.uniforms(NoiseChannel::outlier, {frame++, row.x, row.y}, row.first, row.second);
    benchmark::DoNotOptimize(row.first.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * 2 * state.range(0));
}

void mersenne_twister(benchmark::State& state) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (auto _ : state) benchmark::DoNotOptimize(normal(random));
  state.SetItemsProcessed(state.iterations());
}

/// Common random numbers in the usual way: one generator per frame, seeded with the frame's number, from
/// which all pixels are drawn in order.
void mersenne_twister_seeded_per_frame(benchmark::State& state) {
  uint64_t frame = 0;
  for (auto _ : state) {
    std::mt19937_64 random(frame++);
    std::normal_distribution<double> normal;
    for (int i = 0; i < state.range(0); ++i) benchmark::DoNotOptimize(normal(random));
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

/// Applies depth and flow noise to every point of a frame pair and verifies it, as a sweep does.
void noise_on_the_points_of_a_pair(benchmark::State& state) {
  FramePair pair;
  pair.curr = 1;
  pair.width = 1242;
  pair.height = 375;
  pair.camera = {{725, 725, 620.5, 187}, 362.5};
  std::mt19937 random(1);
  for (int i = 0; i < state.range(0); ++i) {
    pair.background.push_back(static_cast<double>(random() % 1242), static_cast<double>(random() % 375),
                              5 + 0.001 * static_cast<double>(random() % 30000), 1.5, 0.5, 12);
  }
  const Noise noise =
      Noise::parse(R"({"depth": {"delta_d_px": 0.2}, "flow": {"epe_x_px": 1.34, "epe_y_px": 0.27}})");
  uint64_t seed = 0;
  for (auto _ : state) {
    const NoisyPair noisy = noise.apply(pair, Draws(seed++, "vdo", "0003"));
    benchmark::DoNotOptimize(noisy.pair.background.depth.data());
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

BENCHMARK(noise_on_the_points_of_a_pair)->Arg(4000)->Unit(benchmark::kMicrosecond);
BENCHMARK(normals_in_batches)->Arg(1242)->Arg(4000);
BENCHMARK(correlated_normals_of_a_row);
BENCHMARK(correlated_normals_of_features);
BENCHMARK(normals_one_by_one);
BENCHMARK(uniforms_in_batches)->Arg(4000);
BENCHMARK(mersenne_twister);
BENCHMARK(mersenne_twister_seeded_per_frame)->Arg(1242);

}  // namespace
}  // namespace sextant
