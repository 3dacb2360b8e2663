#include "sextant/eval/experiment/sweep.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/parallel_for.h"
#include "sextant/base/progress.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/experiment/finished_cases.h"
#include "sextant/eval/experiment/noise_of_cases.h"
#include "sextant/eval/experiment/run_journal.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/run_json.h"

namespace sextant {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A source of the plan, ready to run.
struct OpenSource {
  std::unique_ptr<Sequence> sequence;
  /// By what decides which points there are: extraction and the noise on masks.
  std::map<std::string, PackCache::Packed> packs;

  static std::string key(const PlanEstimator& estimator, const PlanLevel& level) {
    return json_line(write_options(estimator.extraction)) + json_line(level.noise.only_masks().options());
  }
};

/// A plan with its sources and estimators at hand; runs single cases.
class PlanRunner {
 public:
  /// For the cases `numbers`: opens their sources only, and decodes them `with_packs`.
  PlanRunner(const SweepConfig& config, const std::vector<uint64_t>& numbers, bool with_packs)
      : config_(config), sources_(config.plan.sources.size()) {
    std::set<size_t> needed;
    for (const uint64_t number : numbers) needed.insert(config.plan.at(number).source);
    for (const size_t index : needed) {
      const SourceSpec& spec = config.plan.sources[index];
      OpenSource& source = sources_[index];
      source.sequence = open_source(spec);
      check_runnable(spec, *source.sequence);
      if (!with_packs) continue;
      for (const PlanEstimator& estimator : config.plan.estimators) {
        for (const PlanLevel& level : config.plan.levels) {
          const std::string key = OpenSource::key(estimator, level);
          if (source.packs.contains(key)) continue;
          source.packs[key] = config.cache.load(spec, *source.sequence, estimator.extraction, level.noise,
                                                config.jobs, config.quiet);
        }
      }
    }
  }

  /// Those of sources without a case have no sequence.
  const std::vector<OpenSource>& sources() const { return sources_; }

  const std::vector<ExtractedPair>& pairs(const PlanCase& c) const {
    return sources_[c.source]
        .packs.at(OpenSource::key(config_.plan.estimators[c.estimator], config_.plan.levels[c.level]))
        .pairs;
  }

  CaseOutcome run(const PlanCase& c) const {
    const Sequence& sequence = *sources_[c.source].sequence;
    CaseSettings settings = case_settings(config_.plan, c);
    settings.rescore = !config_.rescored.empty();
    const fs::path& folder = settings.rescore ? config_.rescored : config_.out;
    if (!folder.empty()) settings.folder = folder / "external" / fmt::format("case_{:06}", c.number);

    PairReader reader(sequence, config_.plan.estimators[c.estimator].extraction, settings.noise, 1);
    std::vector<ExtractedPair> window;
    bool is_first = true;
    const auto next = [&]() -> std::span<const ExtractedPair> {
      if (config_.use_packs)
        return std::exchange(is_first, false) ? std::span(pairs(c)) : std::span<const ExtractedPair>();
      return window = reader.next();
    };
    return std::move(run_cases(sequence, {settings}, next, 1).front());
  }

  /// Whether the content is what the case can have left: of its data, estimator, level and seed.
  bool has_left(const PlanCase& c, std::string_view content) const {
    const SequenceInfo& info = sources_[c.source].sequence->info();
    const CaseSettings s = case_settings(config_.plan, c);
    const auto is_own = [&](const auto& of) {
      return of.dataset == info.dataset && of.sequence == info.sequence && of.seed == s.seed && of.level == s.level &&
             of.noise == s.noise.name();
    };
    const auto is_label = [&](const std::string& label) {
      return label == s.estimator_label || label.starts_with(s.estimator_label + ".");
    };
    try {
      if (config_.plan.keep == KeepOfCases::records) {
        return std::ranges::all_of(parse_records(content, "journal"),
                                   [&](const Record& r) { return is_own(r) && is_label(r.estimator); });
      }
      const CaseSummary summary = decode_case_summary(decode_journal_case(content, "journal").summary, "journal");
      return summary.results.empty() ||
             (is_own(summary) && std::ranges::all_of(summary.results, is_label, &ResultSums::estimator));
    } catch (const Error&) {
      return false;
    }
  }

  /// What plan.json holds of the data: the packs of every source that has a case, by its place in the plan.
  Json data_json() const {
    Json json = Json::object();
    for (size_t s = 0; s < sources_.size(); ++s) {
      for (const auto& [key, packed] : sources_[s].packs)
        json[std::to_string(s)].push_back(packed.file.stem().string());
    }
    return json;
  }

 private:
  const SweepConfig& config_;
  std::vector<OpenSource> sources_;
};

std::vector<uint64_t> numbers_of(const SweepConfig& config) {
  if (config.n_shards < 1 || config.shard > config.n_shards) {
    fail("--shard {}/{}: expected I/N with I in 0..N", config.shard, config.n_shards);
  }
  return cases_of_shard(config.plan, config.shard % config.n_shards, config.n_shards);
}

Json sweep_provenance(const SweepConfig& config, const PlanRunner& runner, const CaseResultWriter& results) {
  Json json = build_provenance();
  json["configuration"] = config.plan.json();
  json["shard"] = {config.shard % config.n_shards, config.n_shards};
  json["cases"] = config.plan.n_cases();
  json["noise"] = results.noise();
  json["sources"] = Json::array();
  for (size_t s = 0; s < runner.sources().size(); ++s) {
    const OpenSource& source = runner.sources()[s];
    if (!source.sequence) continue;
    Json inputs = Json::object();
    Json packs = Json::array();
    for (const auto& [key, packed] : source.packs) {
      packs.push_back(packed.file.stem().string());
      inputs.update(inputs_json(packed.inputs));
    }
    json["sources"].push_back({{"source", config.plan.sources[s].text},
                               {"packs", packs},
                               {"provenance", source.sequence->info().provenance},
                               {"warnings", source.sequence->info().warnings},
                               {"inputs", inputs}});
  }
  return json;
}

/// Writes results and run.json of cases that are all there; returns how many records they were.
uint64_t write_results(const SweepConfig& config, const PlanRunner& runner, const Json& programs, uint64_t n_cases,
                       MergedCases cases) {
  OutputFolder files(config.out);
  CaseResultWriter results(files, config.plan.json(), n_cases);
  while (const auto next = cases.next()) {
    check_interrupt();
    results.add(next->result);
  }
  for (const ExactNoises& noise : cases.noises()) results.add_noise(noise);
  results.close();
  Json provenance = sweep_provenance(config, runner, results);
  provenance["programs"] = programs;
  provenance["records"] = results.n_records();
  write_file(files.path("run.json"), json_text(provenance));
  std::vector<std::string> names = {"run.json"};
  std::ranges::copy(results.names(), std::back_inserter(names));
  files.commit(names);
  return results.n_records();
}

}  // namespace

SweepOutcome sweep(const SweepConfig& config) {
  const std::vector<uint64_t> numbers = numbers_of(config);
  const FolderLock lock(config.out);
  const PlanRunner runner(config, numbers, /*with_packs=*/true);
  const Json plan = {{"plan", config.plan.json()},
                     {"shard", {config.shard % config.n_shards, config.n_shards}},
                     {"data", runner.data_json()},
                     {"programs", {program_identity()}}};
  const Json claimed = claim_folder(config.out, plan, config.replace, config.allow_mixed);
  SweepOutcome outcome;
  outcome.n_cases = numbers.size();
  const fs::path journal_path = config.out / "journal.jsonl";
  if (is_finished_sweep(config.out)) {  // before
    FinishedCases::remove(config.out);  // where it was killed at its very end
    outcome.n_before = numbers.size();
    outcome.n_records = json_member<uint64_t>(read_run_json(config.out), "records", (config.out / "run.json").string(), 0);
    return outcome;
  }
  {
    Json owner = plan;
    owner.erase("programs");
    const std::string owner_id = sha256(json_line(owner));
    FinishedCases finished(config.out, owner_id);
    Journal journal(journal_path, owner_id, [&](uint64_t number, std::string_view content) {
      return std::ranges::binary_search(numbers, number) && !finished.contains(number) &&
             runner.has_left(config.plan.at(number), content);
    });
    remove_temporaries(config.out);
    std::vector<uint64_t> open;
    std::ranges::copy_if(numbers, std::back_inserter(open),
                         [&](uint64_t n) { return !journal.blocks().contains(n) && !finished.contains(n); });
    outcome.n_before = numbers.size() - open.size();
    const Clock::time_point start = Clock::now();
    std::vector<std::vector<std::string>> problems(open.size());
    const NoiseOfCases noise(config.plan.json());
    std::mutex mutex;
    Progress progress("cases", static_cast<int>(open.size()), config.quiet);
    parallel_for(static_cast<int>(open.size()), config.jobs, [&](int i) {
      check_interrupt();
      const PlanCase c = config.plan.at(open[static_cast<size_t>(i)]);
      CaseOutcome done = runner.run(c);
      if (config.plan.keep == KeepOfCases::summary) {
        const NoiseVerification* added = noise.is_counted(c.number) ? &done.noise : nullptr;
        const std::string summary = encode_journal_case(summarize_case(done.records), added);
        const std::scoped_lock lock(mutex);
        journal.append_bytes(c.number, summary);
        if (journal.bytes() >= config.journal_bytes) finished.take_from(journal, noise);
      } else {
        const bool is_noisy = !config.plan.levels[c.level].noise.none();
        journal.append(c.number, done.records.size(), write_records(done.records), is_noisy ? done.noise.sums() : Json());
      }
      problems[static_cast<size_t>(i)] = std::move(done.problems);
      progress.advance();
    });
    outcome.wall_time_s = seconds_since(start);
    for (std::vector<std::string>& of_case : problems)
      std::ranges::move(of_case, std::back_inserter(outcome.problems));
    auto readers = finished.readers();
    readers.push_back(open_journal(journal, config.plan.keep, noise));
    outcome.n_records =
        write_results(config, runner, claimed["programs"], numbers.size(), MergedCases(std::move(readers)));
  }
  fs::remove(journal_path);
  FinishedCases::remove(config.out);
  return outcome;
}

SweepSize size_of_sweep(const SweepConfig& config) {
  const std::vector<uint64_t> numbers = numbers_of(config);
  const PlanRunner runner(config, numbers, /*with_packs=*/false);
  SweepSize size;
  size.n_cases = numbers.size();
  for (const uint64_t number : numbers) {
    const SequenceInfo& info = runner.sources()[config.plan.at(number).source].sequence->info();
    size.n_pairs += static_cast<uint64_t>(info.last_frame - info.first_frame);
  }
  return size;
}

void make_packs(const SweepConfig& config) { PlanRunner(config, numbers_of(config), /*with_packs=*/true); }

}  // namespace sextant
