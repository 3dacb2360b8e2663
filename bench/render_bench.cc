// Time to render one frame of a synthetic scene on one core: all channels together, and each channel alone.

#include <benchmark/benchmark.h>

#include "sextant/datasets/dataset.h"

namespace {

using namespace sextant;

std::unique_ptr<Sequence> open_scene(const char* source, const char* cache = "") {
  SourceSpec spec = SourceSpec::parse(source);
  spec.options["cache"] = cache;
  return open_source(spec);
}

/// Renders every frame in turn, each by a sequence that has just been opened (not timed), so that no geometry
/// is left over from other frames.
void render(benchmark::State& state, const char* source, Channels channels) {
  const int n = open_scene(source)->info().last_frame - 1;
  int k = 1;
  for (auto _ : state) {
    state.PauseTiming();
    auto sequence = open_scene(source);
    state.ResumeTiming();
    benchmark::DoNotOptimize(sequence->read(k, channels));
    state.PauseTiming();
    sequence.reset();
    state.ResumeTiming();
    k = 1 + k % n;
  }
}

/// Renders frames one after the other, as a run reads them: neighbouring frames share the geometry that flow
/// needs.
void in_order(benchmark::State& state, const char* source, Channels channels) {
  const auto sequence = open_scene(source);
  const SequenceInfo& info = sequence->info();
  int frame = info.first_frame;
  for (auto _ : state) {
    benchmark::DoNotOptimize(sequence->read(frame, channels));
    frame = frame == info.last_frame ? info.first_frame : frame + 1;
  }
}

/// Reads the frame from the cache.
void cached(benchmark::State& state, const char* source, Channels channels) {
  const auto sequence = open_scene(source, "/tmp/sextant_render_bench_cache");
  sequence->read(3, channels);
  for (auto _ : state) benchmark::DoNotOptimize(sequence->read(3, channels));
}

constexpr Channels usual_channels{.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};
constexpr Channels all_channels = Channels::all();

void open(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(open_scene("synthetic:s18"));
}

#define SCENE(name, source)                                                                   \
  BENCHMARK_CAPTURE(render, name##_gray_rgb_depth_flow_mask, source, usual_channels)          \
      ->Unit(benchmark::kMillisecond);                                                        \
  BENCHMARK_CAPTURE(render, name##_all, source, all_channels)->Unit(benchmark::kMillisecond); \
  BENCHMARK_CAPTURE(in_order, name##_all, source, all_channels)->Unit(benchmark::kMillisecond)->MinTime(2)

SCENE(s18, "synthetic:s18");
SCENE(s01_turn, "synthetic:s01-turn");
SCENE(city, "synthetic:city");
SCENE(highway, "synthetic:highway");
SCENE(stereo_drive, "synthetic:stereo-drive");

#define CHANNEL(channel) \
  BENCHMARK_CAPTURE(render, s18_##channel, "synthetic:s18", {.channel = true})->Unit(benchmark::kMillisecond)

CHANNEL(rgb);
CHANNEL(rgb_right);
CHANNEL(depth);
CHANNEL(flow);
CHANNEL(backward_flow);
CHANNEL(mask);
BENCHMARK_CAPTURE(cached, s18_all, "synthetic:s18", all_channels)->Unit(benchmark::kMillisecond);
BENCHMARK(open)->Unit(benchmark::kMillisecond);

}  // namespace
