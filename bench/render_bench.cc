// Time to render one frame of a synthetic scene, all channels and geometry alone, on one core.

#include <benchmark/benchmark.h>

#include "sextant/datasets/dataset.h"

namespace {

using namespace sextant;

void render(benchmark::State& state, const char* source, Channels channels) {
  const auto sequence = open_source(SourceSpec::parse(source));
  for (auto _ : state) benchmark::DoNotOptimize(sequence->read(3, channels));
}

constexpr Channels kAll{.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};
constexpr Channels kGeometry{.depth = true, .flow = true, .mask = true};

void open(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(open_source(SourceSpec::parse("synthetic:s18")));
}

BENCHMARK_CAPTURE(render, s18, "synthetic:s18", kAll)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render, s18_geometry, "synthetic:s18", kGeometry)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render, s01_turn, "synthetic:s01-turn", kAll)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render, s01_crossing, "synthetic:s01-crossing", kAll)->Unit(benchmark::kMillisecond);
BENCHMARK(open)->Unit(benchmark::kMillisecond);

}  // namespace
