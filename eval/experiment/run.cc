#include "sextant/eval/experiment/run.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <numeric>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/progress.h"
#include "sextant/base/safe_paths.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/experiment/case_versions.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {
namespace {

using Clock = std::chrono::steady_clock;

/// The run as a plan of one estimator and one level.
Plan plan_of(const RunConfig& config) {
  if (config.n_seeds < 1) fail("seeds = {}: must be >= 1", config.n_seeds);
  const ResolvedOptions options = resolve_options(config.options);
  const auto estimator = make_case_estimator(config.estimator, options.estimator);
  Plan plan;
  plan.sources = config.sources;
  for (SourceSpec& spec : plan.sources) spec.add_options(options.source);
  plan.extraction = options.extraction;
  plan.pipeline = options.pipeline;
  plan.estimators = {{config.estimator, estimator->label(), estimator->options(), options.extraction,
                      options.pipeline, estimator}};
  plan.levels = {{config.level, config.noise}};
  plan.seeds.resize(static_cast<size_t>(config.n_seeds));
  std::iota(plan.seeds.begin(), plan.seeds.end(), uint64_t{0});
  return plan;
}

/// The cases of a source, one per seed.
std::vector<CaseSettings> cases_of(const RunConfig& config, const Plan& plan, size_t source,
                                   const SequenceInfo& info) {
  std::vector<CaseSettings> cases;
  for (size_t i = 0; i < plan.seeds.size(); ++i) {
    CaseSettings settings = case_settings(plan, plan.at(source * plan.seeds.size() + i));
    settings.rescore = config.rescore;
    if (!config.folder.empty())
      settings.folder = config.folder / fmt::format("{}_seed{}", folder_name(info), i);
    cases.push_back(std::move(settings));
  }
  return cases;
}

SourceOutcome estimate_source(const RunConfig& config, const Plan& plan, size_t source,
                              const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  // The next window is decoded while the present one goes through the pipeline.
  PairReader reader(sequence, plan.extraction, config.noise, config.jobs);
  std::vector<ExtractedPair> window;
  std::future<std::vector<ExtractedPair>> ahead;
  const auto read_ahead = [&] {
    ahead = std::async(config.jobs > 1 ? std::launch::async : std::launch::deferred,
                       [&] { return reader.next(); });
  };
  const auto next = [&]() -> std::span<const ExtractedPair> {
    window = ahead.get();
    if (!window.empty()) read_ahead();
    return window;
  };
  Progress progress(info.sequence + " pairs", info.last_frame - info.first_frame, config.quiet);
  const auto on_pair = [&](const FrameResult& result, std::span<const Record> of_pair) {
    if (config.on_pair) config.on_pair(result, of_pair);
    progress.advance();
  };
  read_ahead();
  std::vector<CaseOutcome> seeds =
      run_cases(sequence, cases_of(config, plan, source, info), next, config.jobs, on_pair);
  SourceOutcome out{std::move(seeds.front()), sequence.inputs().entries()};
  for (CaseOutcome& seed : std::span(seeds).subspan(1)) {
    std::ranges::move(seed.records, std::back_inserter(out.records));
    std::ranges::move(seed.problems, std::back_inserter(out.problems));
    out.noise.merge(seed.noise);
  }
  return out;
}

SourceRun run_source(const RunConfig& config, const Plan& plan, size_t source, const Sequence& sequence,
                     std::vector<Record>& records) {
  std::optional<SourceOutcome> done = config.journal ? config.journal->find(source) : std::nullopt;
  if (!done) {
    done = estimate_source(config, plan, source, sequence);
    if (config.journal) config.journal->append(source, *done);
  }
  std::ranges::move(done->records, std::back_inserter(records));
  SourceRun out;
  out.source = config.sources[source].text;
  out.info = sequence.info();
  out.truth = sequence.truth().camera;
  out.tracks = body_tracks(done->motions, sequence.truth(), out.info);
  out.motions = std::move(done->motions);
  if (!config.noise.none()) out.noise = done->noise.json(config.noise.options());
  out.problems = std::move(done->problems);
  out.inputs = std::move(done->inputs);
  return out;
}

/// Two sources must not give records that look alike.
void check_distinct(const std::vector<std::unique_ptr<Sequence>>& sequences,
                    const std::vector<SourceSpec>& specs) {
  for (size_t i = 0; i < sequences.size(); ++i) {
    const SequenceInfo& info = sequences[i]->info();
    for (size_t j = 0; j < i; ++j) {
      if (share_pairs(info, sequences[j]->info())) {
        fail("sources '{}' and '{}' are frames of the same {} sequence '{}': give each once", specs[j].text,
             specs[i].text, info.dataset, info.sequence);
      }
      if (folder_name(info) == folder_name(sequences[j]->info())) {
        fail("sources '{}' and '{}' would both write into '{}': run them into a folder each", specs[j].text, specs[i].text,
             folder_name(info));
      }
    }
  }
}

}  // namespace

std::string folder_name(const SequenceInfo& info) {
  std::string name =
      fmt::format("{}_{}_{}-{}", info.dataset, info.sequence, info.first_frame, info.last_frame);
  return safe_file_name(name);
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

void follow_procedure(const std::string& name, bool with_noise, RunConfig& config) {
  Json options = procedure_options(name, config.estimator);
  options.merge_patch(config.options);
  config.options = std::move(options);
  if (!with_noise) return;
  const Json noise = find_procedure(name).at("noise");
  config.noise = Noise(noise.at("noise"));
  config.level = noise.at("level");
}

Json resolved_configuration(const RunConfig& config) {
  const Plan plan = plan_of(config);
  Json json;
  json["sources"] = Json::array();
  for (const SourceSpec& spec : config.sources) json["sources"].push_back(spec.text);
  json["estimator"] = config.estimator;
  json["options"] = {{"extraction", write_options(plan.extraction)},
                     {"pipeline", write_options(plan.pipeline)},
                     {"estimator", plan.estimators.front().options},
                     {"source", resolve_options(config.options).source}};
  json["noise"] = config.noise.options();
  json["level"] = config.level;
  json["seeds"] = config.n_seeds;
  return json;
}

Fingerprints run_fingerprints(const RunConfig& config) {
  if (!config.rescore) return present_fingerprints(plan_of(config));
  const fs::path folder = config.folder.parent_path();
  if (!fs::exists(folder / "run.json")) return {};  // a run that is not finished: its report looks at it again
  return fingerprints_in(read_run_json(folder), (folder / "run.json").string());
}

RunResult run(const RunConfig& config) {
  const Clock::time_point start = Clock::now();
  if (config.sources.empty()) fail("no source given: expected at least one ADAPTER:PATH");
  if (config.jobs < 1) fail("jobs = {}: must be >= 1", config.jobs);
  const Plan plan = plan_of(config);
  std::vector<std::unique_ptr<Sequence>> sequences;
  for (const SourceSpec& spec : plan.sources) {
    sequences.push_back(open_source(spec));
    check_runnable(spec, *sequences.back());
  }
  check_distinct(sequences, plan.sources);

  RunResult result{
      .configuration = resolved_configuration(config), .fingerprints = run_fingerprints(config), .jobs = config.jobs};
  for (size_t i = 0; i < sequences.size(); ++i) {
    result.sources.push_back(run_source(config, plan, i, *sequences[i], result.records));
    sequences[i].reset();
  }
  result.wall_time_s = std::chrono::duration<double>(Clock::now() - start).count();
  return result;
}

}  // namespace sextant
