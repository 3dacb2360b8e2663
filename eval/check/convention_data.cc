#include "sextant/eval/check/convention_data.h"

#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

constexpr double samples_per_frame = 5000;

}  // namespace

ConventionData make_convention_data(const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  ConventionData data{.camera = info.camera,
                      .width = info.width,
                      .height = info.height,
                      .rate_hz = info.rate_hz,
                      .first_frame = info.first_frame};
  data.frames.resize(static_cast<size_t>(info.last_frame - info.first_frame + 1));
  const double area = static_cast<double>(info.width) * info.height;
  data.step = std::max(1, static_cast<int>(std::lround(std::sqrt(area / samples_per_frame))));
  data.depth_kind = info.depth_kind;
  data.truth = sequence.truth();
  data.floor = truth_floor(sequence);
  data.times_s = info.times_s;
  return data;
}

std::vector<FlowSample> flow_samples(const ConventionData& data, int k) {
  const int from = k + data.flow_from, to = k + data.flow_to;
  if (!data.has(k) || !data.has(from) || !data.has(to)) return {};
  const Image<Flow>& flow = data.at(k).flow;
  const Image<float>& depth = data.at(from).depth_m;
  const Image<uint16_t>& mask = data.at(from).mask;
  if (flow.empty() || depth.width() != flow.width() || depth.height() != flow.height()) return {};
  const bool masked = mask.width() == flow.width() && mask.height() == flow.height();
  std::vector<FlowSample> samples;
  samples.reserve(flow.size());
  for (const auto [i, j] : pixels(flow)) {
    const float z = depth(i, j);
    if (!flow(i, j).valid() || !std::isfinite(z) || z <= 0) continue;
    samples.push_back({data.pixel(i), data.pixel(j), z, flow(i, j), masked ? mask(i, j) : 0});
  }
  return samples;
}

}  // namespace sextant
