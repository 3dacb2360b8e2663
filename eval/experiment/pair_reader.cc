#include "sextant/eval/experiment/pair_reader.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/machine.h"

namespace sextant {
namespace {

constexpr int window_pairs = 16;

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

bool earlier(const FlowSamples::Sample& a, const FlowSamples::Sample& b) {
  return std::tie(a.y, a.x) < std::tie(b.y, b.x);
}

void add_samples(const Image<Flow>& dense, const Correspondences& points,
                 std::vector<FlowSamples::Sample>& samples) {
  for (size_t i = 0; i < points.size(); ++i) {
    const auto x = static_cast<int>(std::lround(points.u[i]));
    const auto y = static_cast<int>(std::lround(points.v[i]));
    if (dense.contains(x, y)) samples.push_back({x, y, dense(x, y)});
  }
}

}  // namespace

void check_runnable(const SourceSpec& spec, const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  if (info.last_frame <= info.first_frame) {
    fail("{}: has frames {}-{}; at least two are needed", spec.text, info.first_frame, info.last_frame);
  }
  if (!info.channels.gray || !info.channels.depth || !info.channels.flow || !info.channels.mask) {
    fail("{}: lacks images, depth, flow or masks; a run needs all four", spec.text);
  }
  sequence.check_files();
}

FlowSamples::FlowSamples(std::vector<Sample> samples) : samples_(std::move(samples)) {
  std::ranges::stable_sort(samples_, earlier);
  const auto same = [](const Sample& a, const Sample& b) { return a.x == b.x && a.y == b.y; };
  samples_.erase(std::unique(samples_.begin(), samples_.end(), same), samples_.end());
}

Flow FlowSamples::at(int x, int y) const {
  const auto it = std::ranges::lower_bound(samples_, Sample{x, y, {}}, earlier);
  return it != samples_.end() && it->x == x && it->y == y ? it->flow : Flow{};
}

FlowSamples sample_flow(const Image<Flow>& dense, const FramePair& pair) {
  std::vector<FlowSamples::Sample> samples;
  add_samples(dense, pair.background, samples);
  for (const ObjectObservation& object : pair.objects) add_samples(dense, object.points, samples);
  return FlowSamples(std::move(samples));
}

PairReader::PairReader(const Sequence& sequence, const ExtractionOptions& options, Noise noise, int jobs)
    : sequence_(sequence),
      options_(options),
      noise_(std::move(noise)),
      jobs_(jobs),
      next_(sequence.info().first_frame) {}

std::vector<ExtractedPair> PairReader::next() {
  const int n = std::min(window_pairs, sequence_.info().last_frame - next_);
  if (n <= 0) return {};
  std::vector<Decoded> frames(static_cast<size_t>(n) + 1);
  const int known = border_ ? 1 : 0;
  if (border_) frames.front() = std::move(*border_);
  parallel_for(n + 1 - known, jobs_,
               [&](int i) { frames[static_cast<size_t>(i + known)] = decode(next_ + known + i); });
  std::vector<ExtractedPair> pairs(static_cast<size_t>(n));
  parallel_for(n, jobs_, [&](int i) {
    const auto at = static_cast<size_t>(i);
    pairs[at] = extract(frames[at], frames[at + 1]);
  });
  border_ = std::move(frames.back());
  next_ += n;
  return pairs;
}

PairReader::Decoded PairReader::decode(int index) const {
  check_interrupt();
  const bool is_last = index == sequence_.info().last_frame;
  Channels channels;
  channels.depth = channels.mask = true;
  channels.gray = channels.flow = !is_last;
  const Clock::time_point start = Clock::now();
  Decoded decoded{.frame = sequence_.read(index, channels), .decode_ms = ms_since(start)};
  if (noise_.changes_masks()) noise_.corrupt_mask(decoded.frame.mask);
  if (!is_last) decoded.true_flow = sequence_.true_flow(index);
  return decoded;
}

ExtractedPair PairReader::extract(const Decoded& prev, const Decoded& curr) const {
  check_interrupt();
  const SequenceInfo& info = sequence_.info();
  ExtractedPair extracted;
  const Clock::time_point start = Clock::now();
  extracted.pair = extract_frame_pair(prev.frame, curr.frame, info.camera, 1.0 / info.rate_hz, options_);
  extracted.extraction_ms = ms_since(start);
  extracted.decode_ms = prev.decode_ms;
  if (prev.true_flow) extracted.true_flow = sample_flow(*prev.true_flow, extracted.pair);
  return extracted;
}

}  // namespace sextant
