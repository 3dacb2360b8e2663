#include "sextant/eval/experiment/case_runner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <optional>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/machine.h"
#include "sextant/eval/experiment/evaluate_pair.h"
#include "sextant/geometry/object_motion.h"

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

namespace {

/// Samples `dense` at the pixels of all points of a pair.
FlowSamples sample_flow(const Image<Flow>& dense, const FramePair& pair) {
  std::vector<FlowSamples::Sample> samples;
  add_samples(dense, pair.background, samples);
  for (const ObjectObservation& object : pair.objects) add_samples(dense, object.points, samples);
  return FlowSamples(std::move(samples));
}

}  // namespace

PairReader::PairReader(const Sequence& sequence, const ExtractionOptions& options, Noise noise, int jobs)
    : sequence_(sequence),
      options_(options),
      noise_(std::move(noise)),
      jobs_(jobs),
      next_(sequence.info().first_frame) {}

// A run calls next() directly. A sweep, such as an experiment of the reproduction, reads the same pairs
// from a correspondence cache that is filled from here and stores every number exactly.
std::vector<ExtractedPair> PairReader::next() {
  const int n = std::min(window_pairs, sequence_.info().last_frame - next_);
  if (n <= 0) return {};
  std::vector<Decoded> frames(static_cast<size_t>(n) + 1);
  const int n_carried = border_ ? 1 : 0;  // the last frame of the previous window
  if (border_) frames.front() = std::move(*border_);
  parallel_for(n + 1 - n_carried, jobs_,
               [&](int i) { frames[static_cast<size_t>(i + n_carried)] = decode(next_ + n_carried + i); });
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
  // read() of the source's adapter; for `vdo:` sources open_vdo_folder() (datasets/vdo_folder.cc) says from
  // which files.
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

namespace {

void extend_motions(const FrameResult& result, CaseMotions& motions) {
  const std::optional<SE3> T_world_prev = motions.estimated.pose(result.prev);
  if (result.ego.status != Status::ok || !T_world_prev) return;
  const SE3 T_world_curr = *T_world_prev * result.ego.estimate.T_curr_prev.inverse();
  motions.estimated.set(result.curr, T_world_curr);
  for (const BodyResult& body : result.objects) {
    if (body.status != Status::ok) continue;
    motions.objects[body.instance][result.curr] =
        world_motion(*T_world_prev, T_world_curr, body.estimate.T_curr_prev);
  }
}

class CaseRunner {
 public:
  CaseRunner(const Sequence& sequence, const CaseSettings& settings)
      : sequence_(sequence), settings_(settings), point_noise_(settings.noise.without_masks()) {
    const SequenceInfo& info = sequence.info();
    if (!point_noise_.none()) draws_.emplace(settings_.seed, info.dataset, info.sequence);
    const std::optional<SE3> first = sequence.truth().camera.pose(info.first_frame);
    start_.starts_at_truth = first.has_value();
    start_.estimated.set(info.first_frame, first.value_or(SE3()));
  }

  void process(const ExtractedPair& extracted, const PairObserver& on_pair);

  CaseOutcome finish() {
    for (const Result& result : results_) {
      std::ranges::move(result.estimator->problems(), std::back_inserter(out_.problems));
      if (settings_.estimator->is_third_party())
        std::ranges::move(diagnose_case(result.motions, sequence_.truth(), result.identity.estimator,
                                        result.estimator->recorded()),
                          std::back_inserter(out_.problems));
    }
    out_.motions = results_.empty() ? std::move(start_) : std::move(results_.front().motions);
    return std::move(out_);
  }

 private:
  struct Result {
    Record identity;  ///< PairContext::identity
    std::unique_ptr<PairEstimator> estimator;
    CaseMotions motions;
  };

  /// Called at the first pair, because an estimator may use the whole sequence.
  void begin() {
    std::vector<NamedEstimator> pair_estimators =
        settings_.estimator->begin({sequence_, settings_.pipeline, settings_.noise, settings_.seed,
                                    settings_.folder, settings_.rescore});
    for (NamedEstimator& named : pair_estimators) {
      const Record identity{
          .dataset = sequence_.info().dataset,
          .sequence = sequence_.info().sequence,
          .estimator = settings_.estimator_label + (named.name.empty() ? "" : "." + named.name),
          .noise = settings_.noise.name(),
          .level = settings_.level,
          .seed = settings_.seed};
      results_.push_back({identity, std::move(named.estimator), start_});
    }
  }

  const Sequence& sequence_;
  const CaseSettings& settings_;
  Noise point_noise_;
  std::optional<Draws> draws_;  ///< only with noise
  CaseMotions start_;           ///< before the first pair
  std::vector<Result> results_;
  CaseOutcome out_;
};

void CaseRunner::process(const ExtractedPair& extracted, const PairObserver& on_pair) {
  static const Trajectory none;
  if (results_.empty()) begin();
  std::optional<NoisyPair> noisy;
  if (draws_) {
    noisy = point_noise_.apply(extracted.pair, *draws_);
    out_.noise.merge(noisy->achieved);
  }
  const SequenceInfo& info = sequence_.info();
  const size_t n_before = out_.records.size();
  std::optional<FrameResult> first;
  for (Result& result : results_) {
    // The estimators of this library run inside FrameEstimator::process() (lib/estimator/pipeline.cc).
    FrameResult frame = result.estimator->process(noisy ? noisy->pair : extracted.pair);
    extend_motions(frame, result.motions);
    std::vector<Record> records = evaluate_pair(
        frame, {result.identity, info.camera.left, sequence_.truth(),
                start_.starts_at_truth ? result.motions.estimated : none,
                extracted.true_flow ? &*extracted.true_flow : nullptr, draws_ ? &extracted.pair : nullptr});
    Record& ego = records.front();
    ego.time_ms["extraction"] = extracted.extraction_ms;
    ego.time_ms["decode"] = extracted.decode_ms;
    result.estimator->add_costs(frame.curr, ego);
    check_listed(records);
    std::ranges::move(records, std::back_inserter(out_.records));
    if (!first) first = std::move(frame);
  }
  if (on_pair) on_pair(*first, std::span(out_.records).subspan(n_before));
}

}  // namespace

std::vector<CaseOutcome> run_cases(const Sequence& sequence, const std::vector<CaseSettings>& cases,
                                   const NextPairs& next, int jobs, const PairObserver& on_pair) {
  std::vector<CaseRunner> runners;
  for (const CaseSettings& settings : cases) runners.emplace_back(sequence, settings);
  const auto n = static_cast<int>(runners.size());
  for (std::span<const ExtractedPair> pairs = next(); !pairs.empty(); pairs = next()) {
    parallel_for(n, n > 1 ? jobs : 1, [&](int i) {
      for (const ExtractedPair& pair : pairs) {
        check_interrupt();
        runners[static_cast<size_t>(i)].process(pair, i == 0 ? on_pair : PairObserver());
      }
    });
  }
  std::vector<CaseOutcome> outcomes;
  for (CaseRunner& runner : runners) outcomes.push_back(runner.finish());
  return outcomes;
}

}  // namespace sextant
