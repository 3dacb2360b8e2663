#include "sextant/eval/experiment/sweep.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <mutex>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/machine.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/experiment/noise_of_cases.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A source of the plan, opened.
struct OpenSource {
  std::unique_ptr<Sequence> sequence;
  /// Cached correspondences, by the options that determine the points: extraction and the noise on masks.
  std::map<std::string, PackCache::Packed> packs;

  static std::string key(const PlanEstimator& estimator, const PlanLevel& level) {
    return json_line(write_options(estimator.extraction)) + json_line(level.noise.only_masks().options());
  }
};

/// A plan with its opened sources and estimators; runs single cases.
class PlanRunner {
 public:
  /// Opens only the sources of the cases `numbers`; `with_packs` also loads their pairs, from the cache or by
  /// decoding.
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

  /// Sources of the plan; `sequence` is null for sources without a case in this shard.
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
    if (!folder.empty()) settings.folder = folder / "external" / case_folder(c.number);

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

  /// Returns true if `content` is consistent with the case: its data, estimator, level and seed.
  bool has_left(const PlanCase& c, std::string_view content) const {
    const SequenceInfo& info = sources_[c.source].sequence->info();
    const CaseSettings s = case_settings(config_.plan, c);
    const auto is_own = [&](const auto& of) {
      return of.dataset == info.dataset && of.sequence == info.sequence && of.seed == s.seed &&
             of.level == s.level && of.noise == s.noise.name();
    };
    const auto is_label = [&](const std::string& label) {
      return label == s.estimator_label || label.starts_with(s.estimator_label + ".");
    };
    try {
      if (config_.plan.keep == KeepOfCases::records) {
        return std::ranges::all_of(parse_records(content, "journal"),
                                   [&](const Record& r) { return is_own(r) && is_label(r.estimator); });
      }
      const CaseSummary summary =
          decode_case_summary(decode_journal_case(content, "journal").summary, "journal");
      return summary.results.empty() ||
             (is_own(summary) && std::ranges::all_of(summary.results, is_label, &ResultSums::estimator));
    } catch (const Error&) {
      return false;
    }
  }

  /// Returns the data in plan.json: the cache files of every source with a case, by its index in the plan.
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
    fail("--shard {}/{}: expected I/N with N >= 1 and I in 0..N", config.shard, config.n_shards);
  }
  return cases_of_shard(config.plan, config.shard % config.n_shards, config.n_shards);
}

/// Returns a warning for each source whose camera has another stereo baseline than the depth noise of a
/// level.
std::vector<std::string> baseline_warnings(const SweepConfig& config, const PlanRunner& runner) {
  std::vector<std::string> warnings;
  for (const OpenSource& source : runner.sources()) {
    if (!source.sequence) continue;
    const SequenceInfo& info = source.sequence->info();
    for (const PlanLevel& level : config.plan.levels) {
      const std::string warning = level.noise.baseline_warning(info.camera);
      if (!warning.empty()) add_distinct(fmt::format("{}: {}", info.sequence, warning), warnings);
    }
  }
  return warnings;
}

/// Returns the sources with a case in this shard for run.json, each with the hashes of its files.
Json sources_json(const SweepConfig& config, const PlanRunner& runner) {
  Json sources = Json::array();
  for (size_t s = 0; s < runner.sources().size(); ++s) {
    const OpenSource& source = runner.sources()[s];
    if (!source.sequence) continue;
    Json inputs = Json::object();
    Json packs = Json::array();
    for (const auto& [key, packed] : source.packs) {
      packs.push_back(packed.file.stem().string());
      inputs.update(inputs_json(packed.inputs));
    }
    sources.push_back({{"source", config.plan.sources[s].text},
                       {"packs", packs},
                       {"provenance", source.sequence->info().provenance},
                       {"warnings", source.sequence->info().all_warnings()},
                       {"inputs", inputs}});
  }
  return sources;
}

Json sweep_provenance(const SweepConfig& config, const PlanRunner& runner, const CaseResultWriter& results) {
  Json json = build_provenance();
  json["configuration"] = config.plan.json();
  json["shard"] = {config.shard % config.n_shards, config.n_shards};
  json["cases"] = config.plan.n_cases();
  json["noise"] = results.noise();
  json["sources"] = sources_json(config, runner);
  return json;
}

/// Writes results and run.json when all cases are finished; returns the number of records.
uint64_t write_results(const SweepConfig& config, const PlanRunner& runner, const Json& claimed,
                       uint64_t n_cases, MergedCases cases) {
  OutputFolder files(config.out);
  CaseResultWriter results(files, config.plan.json(), n_cases);
  while (const auto next = cases.next()) {
    check_interrupt();
    results.add(next->result);
  }
  for (const ExactNoises& noise : cases.noises()) results.add_noise(noise);
  results.close();
  Json provenance = sweep_provenance(config, runner, results);
  provenance["programs"] = claimed["programs"];
  if (claimed.contains(fingerprints_key)) provenance[fingerprints_key] = claimed[fingerprints_key];
  provenance["records"] = results.n_records();
  write_file(files.path("run.json"), json_text(provenance));
  std::vector<std::string> names = {"run.json"};
  std::ranges::copy(results.names(), std::back_inserter(names));
  files.commit(names);
  return results.n_records();
}

using StaleCases = std::map<std::string, uint64_t>;  ///< number of stale cases by label of their estimator

void report_stale(const SweepConfig& config, const CaseVersions& versions, const StaleCases& stale,
                  const char* what_becomes) {
  if (!config.on_message) return;
  for (const auto& [label, n] : stale)
    config.on_message(
        fmt::format("{}: {}: {}", config.out.string(), versions.stale_text(label, n), what_becomes));
}
constexpr const char* is_kept = "kept, as --reuse-stale says";
constexpr const char* is_run_again = "run again (--reuse-stale keeps them)";

uint64_t count_lines(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  uint64_t n = 0;
  for (std::vector<char> block(size_t{1} << 20U); file;) {
    check_interrupt();
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    n += static_cast<uint64_t>(std::count(block.begin(), block.begin() + file.gcount(), '\n'));
  }
  return n;
}

/// Returns the number of records of a finished sweep. Throws Error if its records were cut off or changed.
uint64_t check_records(const SweepConfig& config) {
  const Json run = read_run_json(config.out);
  const auto stated = json_member<uint64_t>(run, "records", (config.out / "run.json").string(), 0);
  if (config.plan.keep != KeepOfCases::records) return stated;
  const std::string missing = missing_records(run, count_lines(config.out / "records.jsonl"), config.out);
  if (!missing.empty()) fail("{}; --force starts the sweep over", missing);
  return stated;
}

/// Moves cases of a finished sweep into the journal, and turns the folder into that of an unfinished sweep.
void reopen(const SweepConfig& config, const Json& claimed, const std::set<uint64_t>& kept,
            Journal& journal) {
  if (!kept.empty()) {
    const auto reader = open_case_results(config.out, config.plan.keep);
    while (const auto result = reader->next()) {
      check_interrupt();
      if (kept.contains(result->number))
        journal.append(result->number, result->n_records, result->content, result->noise);
    }
  }
  remove_results(config.out);
  write_file(config.out / "plan.json", json_text(claimed));
}

/// Returns the versions of estimators behind the results, for plan.json and run.json: those of the journal's
/// blocks, the present one for cases in `finished` and, if these may be stale (reuse_stale), all known ones.
/// An estimator that changed during the sweep has both versions.
Fingerprints used_versions(const SweepConfig& config, const CaseVersions& versions, const Journal& journal,
                           const FinishedCases& finished) {
  Fingerprints used;
  for (const auto& [number, block] : journal.blocks()) versions.add_used(number, block.version, used);
  for (const auto& [label, now] : versions.now()) {
    std::vector<Fingerprint>& made = used[label];
    const auto known = versions.known().find(label);
    if (finished.n_cases() > 0 || made.empty()) add_distinct(now.front(), made);
    if (finished.n_cases() > 0 && config.reuse_stale && known != versions.known().end()) {
      for (const Fingerprint& version : known->second) add_distinct(version, made);
    }
  }
  if (!config.rescored.empty()) return used;
  Fingerprints at_the_end;
  try {
    at_the_end = present_fingerprints(config.plan);
  } catch (const Error& error) {  // do not lose hours of results because a file is gone
    if (config.on_message)
      config.on_message(fmt::format("{}: the program that ran cannot be read any more: {}",
                                    config.out.string(), error.what()));
    for (const auto& [label, ignored] : versions.now()) at_the_end[label] = {Fingerprint{}};
  }
  for (const auto& [label, after] : at_the_end) {
    const Fingerprint& before = versions.now().at(label).front();
    if (after.front() == before) continue;
    add_distinct(after.front(), used[label]);
    if (config.on_message) {
      config.on_message(fmt::format("{}: '{}' changed while it ran ({}): run the same command again",
                                    config.out.string(), label, difference(before, after.front())));
    }
  }
  return used;
}

}  // namespace

SweepOutcome sweep(const SweepConfig& config) {
  const std::vector<uint64_t> numbers = numbers_of(config);
  const FolderLock lock(config.out);
  const PlanRunner runner(config, numbers, /*with_packs=*/true);
  if (!config.rescored.empty())
    check_unchanged_data(config.rescored, {{"sources", sources_json(config, runner)}});
  const Fingerprints now = config.rescored.empty() ? present_fingerprints(config.plan)
                                                   : rescored_fingerprints(config.plan, config.rescored);
  Json plan = {{"plan", config.plan.json()},
               {"shard", {config.shard % config.n_shards, config.n_shards}},
               {"data", runner.data_json()},
               {"programs", {program_identity()}}};
  const std::string name =
      sha256(json_line({{"plan", plan_key(plan["plan"])}, {"shard", plan["shard"]}, {"data", plan["data"]}}));
  if (!now.empty()) plan[fingerprints_key] = fingerprints_json(now);
  if (config.on_message && !config.quiet) {
    for (const auto& [label, version] : now) {
      for (const std::string& what : version.front().not_seen)
        config.on_message(fmt::format("'{}': changes are not detected in {}", label, what));
    }
  }
  if (config.force) remove_sweep(config.out);
  Json claimed = claim_folder(config.out, plan, config.replace, config.allow_mixed);
  const CaseVersions versions(config.plan, name, now,
                              fingerprints_in(claimed, (config.out / "plan.json").string()));
  SweepOutcome outcome;
  outcome.n_cases = numbers.size();
  const fs::path journal_path = config.out / "journal.jsonl";
  const bool was_finished = is_finished_sweep(config.out);
  std::set<uint64_t> kept;  // cases of a finished sweep that continues
  if (was_finished) {
    FinishedCases::remove(config.out);  // the sweep was killed at its very end
    StaleCases stale;
    for (const uint64_t number : numbers) {
      if (versions.is_stale(number))
        ++stale[versions.label(number)];
      else
        kept.insert(number);
    }
    outcome.n_stale = numbers.size() - kept.size();
    if (stale.empty() || config.reuse_stale) {
      report_stale(config, versions, stale, is_kept);
      outcome.n_before = numbers.size();
      outcome.n_records = check_records(config);
      return outcome;
    }
    const bool is_summary = config.plan.keep == KeepOfCases::summary;
    if (is_summary) kept.clear();
    report_stale(
        config, versions, stale,
        is_summary ? "all cases are run again, because their summaries cannot be separated" : is_run_again);
    claimed = kept.empty() ? plan : join_claim(config.out, claimed, plan, config.allow_mixed);
  }
  {
    FinishedCases finished(config.out, versions.owner_of_all(), config.reuse_stale);
    const auto owners = [&](uint64_t number) { return versions.owners(number); };
    Journal journal(journal_path, owners, [&](uint64_t number, std::string_view content) {
      return std::ranges::binary_search(numbers, number) && !finished.contains(number) &&
             runner.has_left(config.plan.at(number), content);
    });
    remove_temporaries(config.out);
    if (was_finished) reopen(config, claimed, kept, journal);
    if (!config.reuse_stale) finished.remove_others();
    std::vector<uint64_t> open;
    StaleCases stale;
    for (const uint64_t number : numbers) {
      const auto block = journal.blocks().find(number);
      const bool is_stale = block != journal.blocks().end() && block->second.version > 0;
      if (is_stale) ++stale[versions.label(number)];
      if (is_stale) ++outcome.n_stale;
      const bool is_done = block != journal.blocks().end() && (!is_stale || config.reuse_stale);
      if (!is_done && !finished.contains(number)) open.push_back(number);
    }
    report_stale(config, versions, stale, config.reuse_stale ? is_kept : is_run_again);
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
        const std::scoped_lock one_writer(mutex);
        journal.append_bytes(c.number, summary);
        if (journal.bytes() >= config.journal_bytes) finished.take_from(journal, noise);
      } else {
        const bool is_noisy = !config.plan.levels[c.level].noise.none();
        journal.append(c.number, done.records.size(), write_records(done.records),
                       is_noisy ? done.noise.sums() : Json());
      }
      problems[static_cast<size_t>(i)] = std::move(done.problems);
      progress.advance();
    });
    outcome.wall_time_s = seconds_since(start);
    outcome.problems = baseline_warnings(config, runner);
    for (std::vector<std::string>& of_case : problems)
      std::ranges::move(of_case, std::back_inserter(outcome.problems));
    const Json before = claimed;
    if (!now.empty())
      claimed[fingerprints_key] = fingerprints_json(used_versions(config, versions, journal, finished));
    auto readers = finished.readers();
    readers.push_back(open_journal(journal, config.plan.keep, noise));
    outcome.n_records =
        write_results(config, runner, claimed, numbers.size(), MergedCases(std::move(readers)));
    if (claimed != before) write_file(config.out / "plan.json", json_text(claimed));
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

Json to_json(const SweepOutcome& outcome, const fs::path& out) {
  return {{"out", out.string()},
          {"cases", outcome.n_cases},
          {"cases_before", outcome.n_before},
          {"cases_stale", outcome.n_stale},
          {"records", outcome.n_records},
          {"problems", outcome.problems},
          {"wall_time_s", outcome.wall_time_s}};
}

}  // namespace sextant
