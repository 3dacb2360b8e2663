#include "sextant/eval/experiment/run.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/progress.h"
#include "sextant/eval/experiment/evaluate_pair.h"
#include "sextant/eval/experiment/interrupt.h"
#include "sextant/eval/experiment/pair_reader.h"
#include "sextant/metrics/pose_change.h"

namespace sextant {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Stage 2: the sequential pipeline and the comparison with truth.
class PairConsumer {
 public:
  PairConsumer(const RunConfig& config, const ResolvedOptions& options,
               std::shared_ptr<const Estimator> estimator, const Sequence& sequence, SourceRun& out,
               std::vector<Record>& records)
      : config_(config),
        pipeline_(options.pipeline, std::move(estimator)),
        sequence_(sequence),
        out_(out),
        records_(records) {
    const SequenceInfo& info = sequence.info();
    const std::optional<SE3> first = sequence.truth().camera.pose(info.first_frame);
    out_.starts_at_truth = first.has_value();
    out_.estimated.set(info.first_frame, first.value_or(SE3()));
  }

  void consume(const std::vector<ExtractedPair>& pairs, Progress& progress) {
    for (const ExtractedPair& extracted : pairs) {
      check_interrupt();
      const FrameResult result = pipeline_.process(extracted.pair);
      extend_trajectories(result);
      std::vector<Record> records = evaluate_pair(result, context(extracted));
      records.front().time_ms["extraction"] = extracted.extraction_ms;
      records.front().time_ms["decode"] = extracted.decode_ms;
      if (config_.on_pair) config_.on_pair(result, records);
      std::move(records.begin(), records.end(), std::back_inserter(records_));
      progress.advance();
    }
  }

 private:
  PairContext context(const ExtractedPair& extracted) const {
    static const Trajectory none;
    const SequenceInfo& info = sequence_.info();
    return {info.dataset,
            info.sequence,
            config_.estimator,
            info.camera.left,
            sequence_.truth(),
            out_.starts_at_truth ? out_.estimated : none,
            extracted.true_flow ? &*extracted.true_flow : nullptr};
  }

  void extend_trajectories(const FrameResult& result) {
    const std::optional<SE3> T_world_prev = out_.estimated.pose(result.prev);
    if (result.ego.status != Status::ok || !T_world_prev) return;
    const SE3 T_world_curr = *T_world_prev * result.ego.estimate.T_curr_prev.inverse();
    out_.estimated.set(result.curr, T_world_curr);
    for (const BodyResult& body : result.objects) {
      if (body.status != Status::ok) continue;
      out_.object_motions[body.instance][result.curr] =
          world_motion(*T_world_prev, T_world_curr, body.estimate.T_curr_prev);
    }
  }

  const RunConfig& config_;
  FrameEstimator pipeline_;
  const Sequence& sequence_;
  SourceRun& out_;
  std::vector<Record>& records_;
};

std::unique_ptr<Sequence> open_checked(SourceSpec spec, const Json& source_options) {
  spec.add_options(source_options);
  std::unique_ptr<Sequence> sequence = open_source(spec);
  const SequenceInfo& info = sequence->info();
  if (info.last_frame <= info.first_frame) {
    fail("{}: has frames {}-{}; at least two are needed", spec.text, info.first_frame, info.last_frame);
  }
  if (!info.channels.gray || !info.channels.depth || !info.channels.flow || !info.channels.mask) {
    fail("{}: has no images, depth, flow or masks; a run needs all four", spec.text);
  }
  sequence->check_files();
  return sequence;
}

SourceRun run_source(const std::string& text, const Sequence& sequence, const RunConfig& config,
                     const ResolvedOptions& options, const std::shared_ptr<const Estimator>& estimator,
                     std::vector<Record>& records) {
  SourceRun out;
  out.source = text;
  out.info = sequence.info();
  out.truth = sequence.truth().camera;
  PairReader reader(sequence, options.extraction, config.jobs);
  PairConsumer consumer(config, options, estimator, sequence, out, records);
  Progress progress(out.info.sequence + " pairs", out.info.last_frame - out.info.first_frame, config.quiet);

  // The next window is decoded while the present one goes through the pipeline.
  std::vector<ExtractedPair> window = reader.next();
  while (!window.empty()) {
    std::future<std::vector<ExtractedPair>> ahead = std::async(
        config.jobs > 1 ? std::launch::async : std::launch::deferred, [&] { return reader.next(); });
    consumer.consume(window, progress);
    window = ahead.get();
  }
  out.inputs = sequence.inputs().entries();
  return out;
}

/// Two sources must not give records that look alike.
void check_distinct(const std::vector<std::unique_ptr<Sequence>>& sequences,
                    const std::vector<SourceSpec>& specs) {
  for (size_t i = 0; i < sequences.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const SequenceInfo& a = sequences[i]->info();
      const SequenceInfo& b = sequences[j]->info();
      const bool overlap = a.first_frame < b.last_frame && b.first_frame < a.last_frame;
      if (a.dataset == b.dataset && a.sequence == b.sequence && overlap) {
        fail("sources '{}' and '{}' are frames of the same {} sequence '{}': give each once", specs[j].text,
             specs[i].text, a.dataset, a.sequence);
      }
    }
  }
}

}  // namespace

ResolvedOptions resolve_options(const Json& tree) {
  if (!tree.is_object()) fail("options: expected a JSON object, got {}", tree.dump());
  const std::vector<std::string> known = {"extraction", "pipeline", "estimator", "source"};
  ResolvedOptions options;
  for (const auto& item : tree.items()) {
    if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
      fail("unknown option key '{}': {}", item.key(), suggest(item.key(), known));
    }
    if (!item.value().is_object())
      fail("option {}: expected an object, got {}", item.key(), item.value().dump());
    if (item.key() == "extraction") read_options(item.value(), options.extraction, "extraction");
    if (item.key() == "pipeline") read_options(item.value(), options.pipeline, "pipeline");
    if (item.key() == "estimator") options.estimator = item.value();
    if (item.key() == "source") options.source = item.value();
  }
  return options;
}

Json resolved_configuration(const RunConfig& config) {
  const ResolvedOptions options = resolve_options(config.options);
  Json json;
  json["sources"] = Json::array();
  for (const SourceSpec& spec : config.sources) json["sources"].push_back(spec.text);
  json["estimator"] = config.estimator;
  json["options"] = {{"extraction", write_options(options.extraction)},
                     {"pipeline", write_options(options.pipeline)},
                     {"estimator", make_estimator(config.estimator, options.estimator)->options()},
                     {"source", options.source}};
  return json;
}

RunResult run(const RunConfig& config) {
  const Clock::time_point start = Clock::now();
  if (config.sources.empty()) fail("no source given: expected at least one ADAPTER:PATH");
  if (config.jobs < 1) fail("jobs = {}: must be >= 1", config.jobs);
  const ResolvedOptions options = resolve_options(config.options);
  const std::shared_ptr<const Estimator> estimator = make_estimator(config.estimator, options.estimator);

  std::vector<std::unique_ptr<Sequence>> sequences;
  for (const SourceSpec& spec : config.sources) sequences.push_back(open_checked(spec, options.source));
  check_distinct(sequences, config.sources);

  RunResult result;
  result.jobs = config.jobs;
  result.configuration = resolved_configuration(config);
  for (size_t i = 0; i < sequences.size(); ++i) {
    result.sources.push_back(
        run_source(config.sources[i].text, *sequences[i], config, options, estimator, result.records));
    sequences[i].reset();
  }
  result.wall_time_s = ms_since(start) / 1000.0;
  return result;
}

}  // namespace sextant
