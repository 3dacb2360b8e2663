// The whole pipeline of a frame pair after decoding, and where its time goes. Runs on the KITTI 03 demo when
// SEXTANT_DATA is set, otherwise on a made-up pair of the same size (a wall, a road and one moving box).

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/estimator/registry.h"

namespace sextant {
namespace {

struct Clip {
  std::string name;
  StereoCamera camera;
  double dt_s = 0.1;
  std::vector<Frame> frames;
};

Clip demo_clip(const std::string& folder) {
  const std::unique_ptr<Sequence> sequence = open_source(SourceSpec::parse("vdo:" + folder + "@0-19"));
  Clip clip{"KITTI 03 demo", sequence->info().camera, 1.0 / sequence->info().rate_hz, {}};
  for (int k = sequence->info().first_frame; k <= sequence->info().last_frame; ++k) {
    clip.frames.push_back(sequence->read(k, {.gray = true, .depth = true, .flow = true, .mask = true}));
  }
  return clip;
}

Clip made_up_clip() {
  constexpr int width = 1242;
  constexpr int height = 375;
  Clip clip{"made-up", {{721, 721, 610, 173}, 387}, 0.1, {}};
  const SE3 background(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -1.2));
  const SE3 box(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 0.3));
  for (int k = 0; k < 2; ++k) {
    Frame frame;
    frame.index = k;
    frame.gray = Image<uint8_t>(width, height);
    frame.depth_m = Image<float>(width, height);
    frame.flow = Image<Flow>(width, height);
    frame.mask = Image<uint16_t>(width, height);
    for (const auto [x, y] : pixels(frame.gray)) {
      const bool on_box = x > 750 && x < 1010 && y > 130 && y < 330;
      const double z = on_box    ? 6 + 0.002 * (x - 750)
                       : y > 200 ? std::min(35.0, 1.65 * 721 / (y - 173.0))
                                 : 35;
      const unsigned hash =
          (static_cast<unsigned>(x) / 4 * 2654435761U) ^ (static_cast<unsigned>(y) / 4 * 40503U);
      frame.gray(x, y) = static_cast<uint8_t>(60 + (hash >> 8U) % 120);
      frame.depth_m(x, y) = static_cast<float>(z);
      const Eigen::Vector2d uv =
          clip.camera.left.project((on_box ? box : background) * clip.camera.left.backproject(x, y, z));
      frame.flow(x, y) = {static_cast<float>(uv.x() - x), static_cast<float>(uv.y() - y)};
      frame.mask(x, y) = on_box ? 1 : 0;
    }
    clip.frames.push_back(std::move(frame));
  }
  return clip;
}

const Clip& clip() {
  static const Clip instance = [] {
    const char* root = std::getenv("SEXTANT_DATA");
    const std::filesystem::path demo = std::filesystem::path(root == nullptr ? "" : root) / "kitti_03_demo";
    return std::filesystem::exists(demo) ? demo_clip(demo.string()) : made_up_clip();
  }();
  return instance;
}

std::vector<FramePair> extract_all() {
  std::vector<FramePair> pairs;
  for (size_t k = 0; k + 1 < clip().frames.size(); ++k) {
    pairs.push_back(
        extract_frame_pair(clip().frames[k], clip().frames[k + 1], clip().camera, clip().dt_s, {}));
  }
  return pairs;
}

/// Calls step(k) for one frame pair per benchmark iteration; the clip is repeated in order.
template <typename Step>
void cycle(benchmark::State& state, size_t n, Step step) {
  size_t k = 0;
  for (auto _ : state) {
    step(k);
    k = (k + 1) % n;
  }
  state.SetLabel(clip().name);
}

void features(benchmark::State& state) {
  cycle(state, clip().frames.size() - 1, [](size_t k) {
    const Image<uint8_t>& gray = clip().frames[k].gray;
    benchmark::DoNotOptimize(strongest_per_cell(fast_corners(gray, ExtractionOptions{}.fast_threshold),
                                                gray.width(), gray.height(), {}));
  });
}

void extraction(benchmark::State& state) {
  cycle(state, clip().frames.size() - 1, [](size_t k) {
    benchmark::DoNotOptimize(
        extract_frame_pair(clip().frames[k], clip().frames[k + 1], clip().camera, clip().dt_s, {}));
  });
}

void estimation(benchmark::State& state, const char* name, const Json& options) {
  const std::vector<FramePair> pairs = extract_all();
  FrameEstimator estimator({}, make_estimator(name, options));
  double ego_start_ms = 0, ego_refine_ms = 0, object_start_ms = 0, object_refine_ms = 0, other_ms = 0;
  double ego_points = 0, object_points = 0;
  cycle(state, pairs.size(), [&](size_t k) {
    const FrameResult result = estimator.process(pairs[k]);
    ego_start_ms += result.ego.times.start_ms;
    ego_refine_ms += result.ego.times.refine_ms;
    ego_points += result.ego.n_points;
    for (const BodyResult& body : result.objects) {
      object_start_ms += body.times.start_ms;
      object_refine_ms += body.times.refine_ms;
      other_ms += body.times.other_ms;
      object_points += body.n_points;
    }
  });
  const auto mean = [](double sum) { return benchmark::Counter(sum, benchmark::Counter::kAvgIterations); };
  state.counters["ego_points"] = mean(ego_points);
  state.counters["object_points"] = mean(object_points);
  state.counters["ego_start_ms"] = mean(ego_start_ms);
  state.counters["ego_refine_ms"] = mean(ego_refine_ms);
  state.counters["object_start_ms"] = mean(object_start_ms);
  state.counters["object_refine_ms"] = mean(object_refine_ms);
  state.counters["classify_ms"] = mean(other_ms);
}

void whole_frame(benchmark::State& state, const char* name) {
  FrameEstimator estimator({}, make_estimator(name));
  cycle(state, clip().frames.size() - 1, [&](size_t k) {
    benchmark::DoNotOptimize(estimator.process(
        extract_frame_pair(clip().frames[k], clip().frames[k + 1], clip().camera, clip().dt_s, {})));
  });
}

BENCHMARK(features)->Unit(benchmark::kMillisecond);
BENCHMARK(extraction)->Unit(benchmark::kMillisecond);
const Json defaults = Json::object();
const Json independent = {{"covariance", "independent"}};
BENCHMARK_CAPTURE(estimation, joint_flow, "joint_flow", defaults)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(estimation, joint_flow_depth, "joint_flow_depth", defaults)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(estimation, joint_flow_depth_independent, "joint_flow_depth", independent)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(whole_frame, joint_flow, "joint_flow")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(whole_frame, joint_flow_depth, "joint_flow_depth")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sextant
