#include "sextant/eval/experiment/sweep.h"

#include <algorithm>
#include <chrono>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/parallel_for.h"
#include "sextant/base/progress.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/run_json.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;
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
  const PackCache::Packed& packed(const PlanEstimator& estimator, const PlanLevel& level) const {
    return packs.at(key(estimator, level));
  }
  /// Those of all estimators at a level, each once, in order of estimator.
  std::vector<const PackCache::Packed*> packs_of(const Plan& plan, const PlanLevel& level) const {
    std::vector<const PackCache::Packed*> out;
    for (const PlanEstimator& estimator : plan.estimators) {
      const PackCache::Packed* pack = &packed(estimator, level);
      if (std::ranges::find(out, pack) == out.end()) out.push_back(pack);
    }
    return out;
  }
};

struct CaseOutcome {
  std::vector<Record> records;
  std::vector<std::string> problems;
};

/// A plan with its sources and estimators at hand; runs single cases.
class PlanRunner {
 public:
  explicit PlanRunner(const SweepConfig& config) : config_(config) {
    for (const SourceSpec& spec : config.plan.sources) {
      OpenSource source;
      source.sequence = open_source(spec);
      check_runnable(spec, *source.sequence);
      for (const PlanEstimator& estimator : config.plan.estimators) {
        for (const PlanLevel& level : config.plan.levels) {
          const std::string key = OpenSource::key(estimator, level);
          if (source.packs.contains(key)) continue;
          source.packs[key] = config.cache.load(spec, *source.sequence, estimator.extraction, level.noise,
                                                config.jobs, config.quiet);
        }
      }
      sources_.push_back(std::move(source));
    }
  }

  const std::vector<OpenSource>& sources() const { return sources_; }

  CaseOutcome run(const PlanCase& c) const {
    const OpenSource& source = sources_[c.source];
    const PlanLevel& level = config_.plan.levels[c.level];
    const PlanEstimator& estimator = config_.plan.estimators[c.estimator];
    CaseRunner runner(*source.sequence,
                      {estimator.label, estimator.estimator, estimator.pipeline, level.noise, level.level,
                       c.seed, folder_of(c), !config_.rescored.empty()});
    CaseOutcome out;
    const auto process = [&](const std::vector<ExtractedPair>& pairs) {
      for (const ExtractedPair& extracted : pairs) {
        check_interrupt();
        std::ranges::move(runner.process(extracted).records, std::back_inserter(out.records));
      }
    };
    if (config_.use_packs) {
      process(source.packed(estimator, level).pairs);
    } else {
      PairReader reader(*source.sequence, estimator.extraction, level.noise, 1);
      for (auto window = reader.next(); !window.empty(); window = reader.next()) process(window);
    }
    out.problems = runner.problems();
    return out;
  }

  /// Whether the lines are records that the case can have: of its data, estimator, level and seed.
  bool has_written(const PlanCase& c, std::string_view lines) const {
    const SequenceInfo& info = sources_[c.source].sequence->info();
    const PlanLevel& level = config_.plan.levels[c.level];
    const std::string& label = config_.plan.estimators[c.estimator].label;
    try {
      return std::ranges::all_of(parse_records(lines, "journal"), [&](const Record& r) {
        return r.dataset == info.dataset && r.sequence == info.sequence && r.seed == c.seed &&
               (r.estimator == label || r.estimator.starts_with(label + ".")) && r.level == level.level &&
               r.noise == level.noise.name();
      });
    } catch (const Error&) {
      return false;
    }
  }

  /// What plan.json holds of the data.
  Json data_json() const {
    Json json = Json::array();
    for (const OpenSource& source : sources_) {
      for (const auto& [key, packed] : source.packs) json.push_back(packed.file.stem().string());
    }
    return json;
  }

 private:
  fs::path folder_of(const PlanCase& c) const {
    const fs::path& folder = config_.rescored.empty() ? config_.out : config_.rescored;
    return folder.empty() ? fs::path() : folder / "external" / fmt::format("case_{:06}", c.number);
  }

  const SweepConfig& config_;
  std::vector<OpenSource> sources_;
};

std::vector<uint64_t> cases_of_shard(const SweepConfig& config) {
  if (config.n_shards < 1 || config.shard > config.n_shards) {
    fail("--shard {}/{}: expected I/N with I in 0..N", config.shard, config.n_shards);
  }
  std::vector<uint64_t> numbers;
  for (uint64_t i = 0; i < config.plan.n_cases(); ++i) {
    if (i % config.n_shards == config.shard % config.n_shards) numbers.push_back(i);
  }
  return numbers;
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) {
    fail("{}: cannot make the folder for results: {}", folder.string(),
         error ? error.message() : "it is a file");
  }
}

Json read_plan_file(const fs::path& folder) {
  const Json json = read_json(folder / "plan.json");
  if (!json.is_object() || !json.contains("plan") || !json.contains("shard") || !json.contains("data")) {
    fail("{}: not the plan file of a sweep", (folder / "plan.json").string());
  }
  return json;
}

/// What plan.json holds.
Json plan_file(const SweepConfig& config, const Json& data) {
  return {{"plan", config.plan.json()},
          {"shard", {config.shard % config.n_shards, config.n_shards}},
          {"data", data}};
}

/// Writes plan.json, or sees that the one there is the same.
void claim_folder(const SweepConfig& config, const Json& wanted) {
  make_folder(config.out);
  if (!fs::exists(config.out / "plan.json")) {
    if (fs::exists(config.out / "records.jsonl")) {
      fail("{}: holds the records of something else than a sweep; choose another folder",
           config.out.string());
    }
    write_file(config.out / "plan.json", json_text(wanted));
    return;
  }
  const Json present = read_plan_file(config.out);
  for (const auto& [key, what] : {std::pair{"plan", "another plan"}, std::pair{"shard", "another shard"},
                                  std::pair{"data", "data that have changed since"}}) {
    if (present[key] == wanted[key]) continue;
    if (!config.replace) {
      fail("{}: holds a sweep of {}; choose another folder, or remove it", config.out.string(), what);
    }
    for (const char* file : {"records.jsonl", "cases.jsonl", "run.json", "journal.jsonl"})
      fs::remove(config.out / file);
    write_file(config.out / "plan.json", json_text(wanted));
    return;
  }
}

/// Of write_file() in a process that was killed. Only for who holds the journal's lock.
void remove_temporaries(const fs::path& folder) {
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    for (const char* file : {"plan.json", "run.json", "cases.jsonl", "records.jsonl"}) {
      if (name.starts_with(fmt::format("{}.tmp", file))) left.push_back(entry.path());
    }
  }
  for (const fs::path& file : left) fs::remove(file);
}

std::string case_index(const std::map<uint64_t, Journal::Block>& blocks) {
  std::string text;
  for (const auto& [number, block] : blocks) {
    text += json_line(Json{{"case", number}, {"records", block.n_records}}) + "\n";
  }
  return text;
}

/// Requested and achieved noise of one source at one level, over all seeds.
Json level_noise_json(const SweepConfig& config, const PlanRunner& runner, size_t source, size_t level) {
  const OpenSource& data = runner.sources()[source];
  const SequenceInfo& info = data.sequence->info();
  const PlanLevel& wanted = config.plan.levels[level];
  NoiseVerification achieved;
  for (const uint64_t seed : config.plan.seeds) {
    check_interrupt();
    const Draws draws(seed, info.dataset, info.sequence);
    for (const PackCache::Packed* pack : data.packs_of(config.plan, wanted)) {
      for (const ExtractedPair& pair : pack->pairs)
        achieved.merge(wanted.noise.without_masks().apply(pair.pair, draws).achieved);
    }
  }
  Json entry = {{"source", config.plan.sources[source].text}, {"level", wanted.level}};
  entry["noise"] = achieved.json(wanted.noise.options());
  return entry;
}

/// The same for every source and level that adds any.
Json noise_json(const SweepConfig& config, const PlanRunner& runner) {
  std::vector<std::pair<size_t, size_t>> noisy;
  for (size_t s = 0; s < runner.sources().size(); ++s) {
    for (size_t l = 0; l < config.plan.levels.size(); ++l) {
      if (!config.plan.levels[l].noise.none()) noisy.emplace_back(s, l);
    }
  }
  std::vector<Json> entries(noisy.size());
  parallel_for(static_cast<int>(noisy.size()), config.jobs, [&](int i) {
    const auto at = static_cast<size_t>(i);
    entries[at] = level_noise_json(config, runner, noisy[at].first, noisy[at].second);
  });
  return entries;
}

Json sweep_provenance(const SweepConfig& config, const PlanRunner& runner) {
  Json json = build_provenance();
  json["configuration"] = config.plan.json();
  json["shard"] = {config.shard % config.n_shards, config.n_shards};
  json["cases"] = config.plan.n_cases();
  json["noise"] = noise_json(config, runner);
  json["sources"] = Json::array();
  for (size_t s = 0; s < runner.sources().size(); ++s) {
    const OpenSource& source = runner.sources()[s];
    Json inputs = Json::object();
    Json packs = Json::array();
    for (const auto& [key, packed] : source.packs) {
      packs.push_back(packed.file.stem().string());
      for (const auto& [path, entry] : packed.inputs) {
        inputs[path] = {{"bytes", entry.bytes}, {"sha256", entry.sha256}};
      }
    }
    json["sources"].push_back({{"source", config.plan.sources[s].text},
                               {"packs", packs},
                               {"provenance", source.sequence->info().provenance},
                               {"warnings", source.sequence->info().warnings},
                               {"inputs", inputs}});
  }
  return json;
}

uint64_t count_records(const std::map<uint64_t, Journal::Block>& blocks) {
  uint64_t n = 0;
  for (const auto& [number, block] : blocks) n += block.n_records;
  return n;
}

}  // namespace

SweepOutcome sweep(const SweepConfig& config) {
  const std::vector<uint64_t> numbers = cases_of_shard(config);
  const PlanRunner runner(config);
  const Json plan = plan_file(config, runner.data_json());
  claim_folder(config, plan);
  SweepOutcome outcome;
  outcome.n_cases = numbers.size();
  const fs::path records_path = config.out / "records.jsonl";
  const fs::path journal_path = config.out / "journal.jsonl";
  if (fs::exists(records_path) && !fs::exists(journal_path)) {  // finished before
    outcome.n_before = numbers.size();
    const std::string text = read_file(records_path, records_file);
    outcome.n_records = static_cast<uint64_t>(std::ranges::count(text, '\n'));
    return outcome;
  }
  {
    Journal journal(journal_path, sha256(json_line(plan)), [&](uint64_t number, std::string_view lines) {
      return std::ranges::binary_search(numbers, number) && runner.has_written(config.plan.at(number), lines);
    });
    remove_temporaries(config.out);
    std::vector<uint64_t> open;
    std::ranges::copy_if(numbers, std::back_inserter(open),
                         [&](uint64_t n) { return !journal.blocks().contains(n); });
    outcome.n_before = numbers.size() - open.size();
    const Clock::time_point start = Clock::now();
    std::vector<std::vector<std::string>> problems(open.size());
    Progress progress("cases", static_cast<int>(open.size()), config.quiet);
    parallel_for(static_cast<int>(open.size()), config.jobs, [&](int i) {
      check_interrupt();
      const uint64_t number = open[static_cast<size_t>(i)];
      CaseOutcome done = runner.run(config.plan.at(number));
      journal.append(number, done.records.size(), write_records(done.records));
      problems[static_cast<size_t>(i)] = std::move(done.problems);
      progress.advance();
    });
    outcome.wall_time_s = seconds_since(start);
    for (std::vector<std::string>& of_case : problems)
      std::ranges::move(of_case, std::back_inserter(outcome.problems));
    outcome.n_records = count_records(journal.blocks());
    Json provenance = sweep_provenance(config, runner);
    provenance["records"] = outcome.n_records;
    write_file(config.out / "run.json", json_text(provenance));
    write_file(config.out / "cases.jsonl", case_index(journal.blocks()));
    write_file(records_path, journal.ordered_lines());
    sync_folder(config.out);
  }
  fs::remove(journal_path);
  return outcome;
}

SweepEstimate estimate_sweep(const SweepConfig& config) {
  const std::vector<uint64_t> numbers = cases_of_shard(config);
  SweepConfig dry = config;
  dry.out.clear();
  const PlanRunner runner(dry);
  SweepEstimate estimate;
  estimate.n_cases = numbers.size();
  std::map<std::pair<size_t, size_t>, double> seconds;  // of one case, by source and estimator
  double total_s = 0;
  for (const uint64_t number : numbers) {
    const PlanCase c = config.plan.at(number);
    const auto [it, is_new] = seconds.try_emplace({c.source, c.estimator}, 0.0);
    if (is_new) {
      const Clock::time_point start = Clock::now();
      runner.run(c);
      it->second = seconds_since(start);
    }
    total_s += it->second;
    const OpenSource& source = runner.sources()[c.source];
    estimate.n_pairs +=
        source.packed(config.plan.estimators[c.estimator], config.plan.levels[c.level]).pairs.size();
  }
  estimate.seconds = total_s / config.jobs;
  return estimate;
}

namespace {

/// The lines of a finished shard, by case.
std::map<uint64_t, std::string> read_cases(const fs::path& folder) {
  const std::string records = read_file(folder / "records.jsonl", records_file);
  const std::string index = read_file(folder / "cases.jsonl");
  const std::string name = (folder / "cases.jsonl").string();
  std::map<uint64_t, std::string> cases;
  size_t at = 0;
  int line = 0;
  for (const std::string& text : split(index, '\n')) {
    ++line;
    if (text.empty()) continue;
    const Json entry = parse_json(text, name, line);
    const std::string where = fmt::format("{}:{}", name, line);
    const auto number = json_member<uint64_t>(entry, "case", where);
    size_t end = at;
    for (auto n = json_member<uint64_t>(entry, "records", where); n > 0 && end != std::string::npos; --n) {
      end = records.find('\n', end);
      if (end != std::string::npos) ++end;
    }
    if (end == std::string::npos)
      fail("{}: has fewer records than {} says", (folder / "records.jsonl").string(), name);
    if (!cases.emplace(number, records.substr(at, end - at)).second)
      fail("{}: case {} is there twice", where, number);
    at = end;
  }
  if (at != records.size())
    fail("{}: has more records than {} says", (folder / "records.jsonl").string(), name);
  return cases;
}

}  // namespace

SweepOutcome merge_sweeps(const std::vector<fs::path>& folders, const fs::path& out) {
  if (folders.empty()) fail("merge: no folders given");
  Json first;
  uint64_t n_cases = 0;
  std::map<uint64_t, std::string> cases;
  for (const fs::path& folder : folders) {
    const Json plan = read_plan_file(folder);
    if (first.is_null()) first = plan;
    if (plan["plan"] != first["plan"] || plan["data"] != first["data"]) {
      fail("{}: holds another plan, or other data, than {}", folder.string(), folders.front().string());
    }
    if (!fs::exists(folder / "records.jsonl") || fs::exists(folder / "journal.jsonl")) {
      fail("{}: its sweep is not finished: give its command again first", folder.string());
    }
    for (auto& [number, lines] : read_cases(folder)) {
      if (!cases.emplace(number, std::move(lines)).second) {
        fail("{}: case {} is in an earlier folder too: give each shard once", folder.string(), number);
      }
    }
  }
  const Json run = read_run_json(folders.front());
  n_cases = run.value("cases", uint64_t{0});
  for (uint64_t number = 0; number < n_cases; ++number) {
    if (!cases.contains(number)) {
      fail("case {} of {} is in none of the folders: a shard is missing", number, n_cases);
    }
  }
  SweepOutcome outcome;
  outcome.n_cases = cases.size();
  std::string records, index;
  for (const auto& [number, lines] : cases) {
    const auto n = static_cast<uint64_t>(std::ranges::count(lines, '\n'));
    outcome.n_records += n;
    index += json_line(Json{{"case", number}, {"records", n}}) + "\n";
    records += lines;
  }
  Json provenance = run;
  provenance["shard"] = {0, 1};
  provenance["records"] = outcome.n_records;
  Json plan = first;
  plan["shard"] = {0, 1};
  check_output_folder(out, provenance["configuration"], /*force=*/false);
  write_output_folder(out, {{"plan.json", json_text(plan)},
                            {"run.json", json_text(provenance)},
                            {"cases.jsonl", index},
                            {"records.jsonl", records}});
  return outcome;
}

}  // namespace sextant
