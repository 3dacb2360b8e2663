#include "sextant/eval/experiment/run.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/parallel_for.h"
#include "sextant/base/progress.h"
#include "sextant/eval/experiment/body_tracks.h"
#include "sextant/eval/experiment/pair_reader.h"

namespace sextant {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::unique_ptr<Sequence> open_checked(SourceSpec spec, const Json& source_options) {
  spec.add_options(source_options);
  std::unique_ptr<Sequence> sequence = open_source(spec);
  check_runnable(spec, *sequence);
  return sequence;
}

std::filesystem::path case_folder(const RunConfig& config, const SequenceInfo& info, int seed) {
  if (config.folder.empty()) return {};
  std::string name =
      fmt::format("{}_{}_{}-{}_seed{}", info.dataset, info.sequence, info.first_frame, info.last_frame, seed);
  std::ranges::replace(name, '/', '-');
  return config.folder / name;
}

/// One runner per seed; each goes over the pairs in order.
class SeedRunners {
 public:
  SeedRunners(const RunConfig& config, const ResolvedOptions& options,
              const std::shared_ptr<const CaseEstimator>& estimator, const Sequence& sequence)
      : config_(config), records_(static_cast<size_t>(config.n_seeds)) {
    for (int seed = 0; seed < config.n_seeds; ++seed) {
      runners_.emplace_back(
          sequence, CaseSettings{estimator->label(), estimator, options.pipeline, config.noise, config.level,
                                 static_cast<uint64_t>(seed), case_folder(config, sequence.info(), seed),
                                 config.rescore});
    }
  }

  void consume(const std::vector<ExtractedPair>& pairs, Progress& progress) {
    parallel_for(config_.n_seeds, config_.n_seeds > 1 ? config_.jobs : 1, [&](int seed) {
      for (const ExtractedPair& extracted : pairs) {
        check_interrupt();
        CaseRunner::Outcome outcome = runners_[static_cast<size_t>(seed)].process(extracted);
        if (seed == 0 && config_.on_pair) config_.on_pair(outcome.result, outcome.records);
        std::ranges::move(outcome.records, std::back_inserter(records_[static_cast<size_t>(seed)]));
        if (seed == 0) progress.advance();
      }
    });
  }

  void finish(SourceRun& out, std::vector<Record>& records) {
    for (std::vector<Record>& of_seed : records_) std::ranges::move(of_seed, std::back_inserter(records));
    out.motions = runners_.front().motions();
    for (const CaseRunner& runner : runners_)
      std::ranges::move(runner.problems(), std::back_inserter(out.problems));
    if (config_.noise.none()) return;
    NoiseVerification achieved;
    for (const CaseRunner& runner : runners_) achieved.merge(runner.achieved_noise());
    out.noise = achieved.json(config_.noise.options());
  }

 private:
  const RunConfig& config_;
  std::vector<CaseRunner> runners_;
  std::vector<std::vector<Record>> records_;  ///< by seed
};

SourceRun run_source(const std::string& text, const Sequence& sequence, const RunConfig& config,
                     const ResolvedOptions& options, const std::shared_ptr<const CaseEstimator>& estimator,
                     std::vector<Record>& records) {
  SourceRun out;
  out.source = text;
  out.info = sequence.info();
  out.truth = sequence.truth().camera;
  PairReader reader(sequence, options.extraction, config.noise, config.jobs);
  SeedRunners runners(config, options, estimator, sequence);
  Progress progress(out.info.sequence + " pairs", out.info.last_frame - out.info.first_frame, config.quiet);

  // The next window is decoded while the present one goes through the pipeline.
  std::vector<ExtractedPair> window = reader.next();
  while (!window.empty()) {
    std::future<std::vector<ExtractedPair>> ahead = std::async(
        config.jobs > 1 ? std::launch::async : std::launch::deferred, [&] { return reader.next(); });
    runners.consume(window, progress);
    window = ahead.get();
  }
  runners.finish(out, records);
  out.tracks = body_tracks(out.motions, sequence.truth(), out.info);
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

void check_runnable(const SourceSpec& spec, const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  if (info.last_frame <= info.first_frame) {
    fail("{}: has frames {}-{}; at least two are needed", spec.text, info.first_frame, info.last_frame);
  }
  if (!info.channels.gray || !info.channels.depth || !info.channels.flow || !info.channels.mask) {
    fail("{}: has no images, depth, flow or masks; a run needs all four", spec.text);
  }
  sequence.check_files();
}

ResolvedOptions resolve_options(const Json& tree) {
  if (!tree.is_object()) fail("options: expected a JSON object, got {}", json_excerpt(tree));
  const std::vector<std::string> known = {"extraction", "pipeline", "estimator", "source"};
  ResolvedOptions options;
  for (const auto& item : tree.items()) {
    if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
      fail("unknown option key '{}': {}", item.key(), suggest(item.key(), known));
    }
    if (!item.value().is_object())
      fail("option {}: expected an object, got {}", item.key(), json_excerpt(item.value()));
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
                     {"estimator", make_case_estimator(config.estimator, options.estimator)->options()},
                     {"source", options.source}};
  json["noise"] = config.noise.options();
  json["level"] = config.level;
  json["seeds"] = config.n_seeds;
  return json;
}

RunResult run(const RunConfig& config) {
  const Clock::time_point start = Clock::now();
  if (config.sources.empty()) fail("no source given: expected at least one ADAPTER:PATH");
  if (config.jobs < 1) fail("jobs = {}: must be >= 1", config.jobs);
  if (config.n_seeds < 1) fail("seeds = {}: must be >= 1", config.n_seeds);
  const ResolvedOptions options = resolve_options(config.options);
  const auto estimator = make_case_estimator(config.estimator, options.estimator);

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
