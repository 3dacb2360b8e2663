#include "sextant/eval/benchmark/benchmark_verification.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/benchmark/suite.h"
#include "sextant/eval/experiment/evaluate_pair.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

/// A source of a plan, and the bodies that every estimator must have a record of.
struct CheckedSource {
  SequenceInfo info;
  std::vector<std::pair<int, Interned>> counted;  ///< frame and body, of all that the track counts
};

/// A sweep of the submission, with the plan that the suite requires.
struct CheckedSweep {
  const SuiteTrack* track = nullptr;
  std::string name;
  fs::path folder;
  Json plan;      ///< plan of the folder
  Plan expected;  ///< plan of the suite, with a placeholder for the estimator of the submission
  std::vector<std::optional<CheckedSource>> sources;  ///< of the expected plan; nullopt: its data are missing
  std::vector<uint64_t> n_records;                    ///< number of records by case
};

/// Keys of a plan that determine its cases, apart from the estimator.
Json cases_key(Json plan) {
  plan.erase("estimators");
  plan.erase("name");
  return plan;
}

std::vector<uint64_t> records_by_case(const fs::path& file, uint64_t n_cases) {
  std::vector<uint64_t> numbers;
  const std::string text = read_file(file, records_file);
  size_t line = 0;
  for (size_t begin = 0; begin < text.size(); ++line) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    const std::string where = fmt::format("{}:{}", file.string(), line + 1);
    const Json entry = parse_json(std::string_view(text).substr(begin, end - begin), where);
    if (json_member<uint64_t>(entry, "case", where) != line) fail("{}: case {} is missing", where, line);
    numbers.push_back(json_member<uint64_t>(entry, "records", where));
    begin = end + 1;
  }
  if (numbers.size() != n_cases)
    fail("{}: holds {} cases, the suite has {}: its sweep is not finished, or was changed", file.string(),
         numbers.size(), n_cases);
  return numbers;
}

/// Checks that every record has the data, frames, level, noise, seed and estimator of its case, and that the
/// records of a case are one for each result of the card, frame and body that the track counts. Further
/// records are of bodies that do not count.
void check_records(const CheckedSweep& sweep, const Card& card) {
  using Key = std::tuple<Interned, int, Interned>;  // estimator, frame, body
  const fs::path file = sweep.folder / "records.jsonl";
  uint64_t in_case = 0, number = 0, line = 0;
  std::set<Key> seen, missing;
  const auto begin_case = [&] {
    seen.clear();
    const auto& source = sweep.sources[sweep.expected.at(number).source];
    if (!source) return;
    for (const std::string& result : card.results) {
      for (const auto& [frame, body] : source->counted) missing.emplace(result, frame, body);
    }
  };
  const auto end_finished_cases = [&] {
    while (number < sweep.n_records.size() && in_case == sweep.n_records[number]) {
      if (!missing.empty()) {
        const auto& [estimator, frame, body] = *missing.begin();
        fail("{}:{}: case {} ends without a record of frame {}, body {}, estimator '{}'", file.string(), line,
             number, frame, body.str(), estimator.str());
      }
      in_case = 0;
      if (++number < sweep.n_records.size()) begin_case();
    }
  };
  begin_case();
  end_finished_cases();
  for_each_record(file, [&](Record& record) {
    ++line;
    if (number == sweep.n_records.size())
      fail("{}:{}: more records than cases.jsonl states", file.string(), line);
    const PlanCase expected = sweep.expected.at(number);
    const PlanLevel& level = sweep.expected.levels[expected.level];
    const auto refuse = [&](const std::string& what) {
      fail("{}:{}: record of case {}: {}", file.string(), line, number, what);
    };
    const std::optional<CheckedSource>& source = sweep.sources[expected.source];
    if (source) {
      const SequenceInfo& info = source->info;
      if (record.dataset != info.dataset || record.sequence != info.sequence)
        refuse(fmt::format("data '{} {}', expected '{} {}'", record.dataset.str(), record.sequence.str(),
                           info.dataset, info.sequence));
      if (record.frame <= info.first_frame || record.frame > info.last_frame)
        refuse(
            fmt::format("frame {}, expected {} to {}", record.frame, info.first_frame + 1, info.last_frame));
    }
    if (record.seed != expected.seed) refuse(fmt::format("seed {}, expected {}", record.seed, expected.seed));
    if (record.level != level.level) refuse(fmt::format("level {}, expected {}", record.level, level.level));
    if (record.noise != level.noise.name())
      refuse(fmt::format("noise '{}', expected '{}'", std::string(record.noise), level.noise.name()));
    if (std::ranges::find(card.results, std::string(record.estimator)) == card.results.end())
      refuse(
          fmt::format("estimator '{}', the card is of '{}'", std::string(record.estimator), card.estimator));
    const Key key(record.estimator, record.frame, record.body);
    if (!seen.insert(key).second)
      refuse(fmt::format("a second record of frame {}, body {}", record.frame, record.body.str()));
    // A record with status no_truth may count because of the errors of its flow; its motion has none.
    const bool counts = sweep.track->counts(record) && record.status != Status::no_truth;
    if (counts && missing.erase(key) == 0 && source)
      refuse(fmt::format("frame {}, body {}: has no truth in the data", record.frame, record.body.str()));
    ++in_case;
    end_finished_cases();
  });
  if (number != sweep.n_records.size())
    fail("{}: ends before the records of case {}: the file is cut off", file.string(), number);
}

/// Returns the frames and bodies of a source that the track counts, from the records of an estimator that
/// estimates nothing.
std::vector<std::pair<int, Interned>> counted_bodies(const Sequence& sequence, const SuiteTrack& track) {
  const SequenceInfo& info = sequence.info();
  std::vector<std::pair<int, Interned>> counted;
  for (int frame = info.first_frame + 1; frame <= info.last_frame; ++frame) {
    FrameResult nothing{.prev = frame - 1, .curr = frame, .dt_s = 1.0 / info.rate_hz};
    nothing.ego.status = Status::lost;
    const PairContext context{.identity = {.dataset = info.dataset, .sequence = info.sequence},
                              .camera = info.camera.left,
                              .truth = sequence.truth(),
                              .estimated = Trajectory()};
    for (const Record& record : evaluate_pair(nothing, context))
      if (track.counts(record)) counted.emplace_back(record.frame, record.body);
  }
  return counted;
}

/// Opens the sources of a plan. Data that are missing here are no fault of the submission.
std::vector<std::optional<CheckedSource>> open_sources(const Plan& plan, const SuiteTrack& track) {
  std::vector<std::optional<CheckedSource>> sources;
  for (const SourceSpec& spec : plan.sources) {
    std::optional<CheckedSource>& source = sources.emplace_back();
    try {
      const std::unique_ptr<Sequence> sequence = open_source(spec);
      source = {sequence->info(), counted_bodies(*sequence, track)};
    } catch (const Error&) {
      continue;
    }
  }
  return sources;
}

/// Compares a sweep of the folder with the suite. If its data are not available, only the keys of the records
/// are checked.
CheckedSweep check_plan(const Suite& suite, const SuiteTrack& track, const SuiteSweep& part, const Card& card,
                        const fs::path& folder, const std::string& data_root) {
  CheckedSweep sweep{.track = &track, .name = part.name, .folder = folder / part.name};
  const Json plan_file = read_plan_file(sweep.folder);
  const std::string where = (sweep.folder / "plan.json").string();
  sweep.plan = plan_file["plan"];
  sweep.expected = parse_plan(plan_text(suite, track, part, "joint_flow", card.quick), where, data_root);
  if (cases_key(sweep.plan) != cases_key(sweep.expected.json()))
    fail("{}: its sources, noise, seeds or options are not those of {}: {}", where, suite.name, part.name);
  const Json estimators = json_list(sweep.plan, "estimators", where);
  if (estimators.size() != 1 || json_member<std::string>(estimators[0], "label", where) != card.estimator)
    fail("{}: belongs to another estimator than the card, '{}'", where, card.estimator);
  sweep.sources = open_sources(sweep.expected, track);
  sweep.n_records = records_by_case(sweep.folder / "cases.jsonl", sweep.expected.n_cases());
  return sweep;
}

/// Returns the sweeps that the card must have, after checking them.
std::vector<CheckedSweep> check_sweeps(const Suite& suite, const Card& card, const fs::path& folder,
                                       const std::string& data_root, std::vector<std::string>& lines) {
  std::vector<CheckedSweep> sweeps;
  for (const SuiteTrack& track : suite.tracks) {
    if (const auto reason = card.left_out.find(track.name); reason != card.left_out.end()) {
      lines.push_back(fmt::format("track {}: left out by the card: {}", track.name, reason->second));
      continue;
    }
    for (const SuiteSweep& part : track.sweeps) {
      if (plan_text(suite, track, part, "joint_flow", card.quick).empty()) continue;
      sweeps.push_back(check_plan(suite, track, part, card, folder, data_root));
      check_records(sweeps.back(), card);
    }
  }
  return sweeps;
}

/// Returns the first key in which two JSON values differ: "curves.3.Et_m".
std::string first_difference(const Json& a, const Json& b, const std::string& path = "") {
  if (a.type() != b.type() || a.size() != b.size() || !a.is_structured()) return path;
  for (const auto& item : a.items()) {
    const std::string below = path.empty() ? item.key() : path + "." + item.key();
    const Json* other = nullptr;
    if (b.is_object()) {
      if (!b.contains(item.key())) return below;
      other = &b.at(item.key());
    } else {
      other = &b.at(std::stoul(item.key()));
    }
    if (item.value() != *other) return first_difference(item.value(), *other, below);
  }
  return path;
}

void check_card(const Suite& suite, const Json& stored, const fs::path& folder) {
  Json computed = to_json(make_card(suite, folder));
  Json given = stored;
  for (const char* key : {"costs", "program"}) {
    computed.erase(key);
    given.erase(key);
  }
  if (computed != given)
    fail("{}: the value of '{}' does not agree with the records", (folder / "card.json").string(),
         first_difference(given, computed));
}

/// Returns true if the records have the same frame, body and status, and every number of the stored record
/// agrees with that of the other one within a relative difference of 1e-8. Records may be stored without
/// numbers that no card needs.
bool agrees(const Record& stored, const Record& again) {
  constexpr double digits = 1e-8;
  const auto agree = [&](const Record::Numbers& a, const Record::Numbers& b) {
    return std::ranges::all_of(a, [&](const auto& entry) {
      const auto other = find_number(b, entry.first);
      return other && std::abs(*other - entry.second) <= digits * std::abs(entry.second);
    });
  };
  return stored.frame == again.frame && stored.body == again.body && stored.status == again.status &&
         agree(stored.errors, again.errors) && agree(stored.bound, again.bound) &&
         agree(stored.values, again.values);
}

/// Compares the stored records of a case with those of a run. Only bodies that the track counts must be
/// stored.
bool agree(const std::vector<Record>& stored, const std::vector<Record>& again, const SuiteTrack& track) {
  const auto has_each = [](const std::vector<Record>& all, const auto& same) {
    return std::ranges::any_of(all, same);
  };
  return std::ranges::all_of(stored,
                             [&](const Record& record) {
                               return has_each(again,
                                               [&](const Record& other) { return agrees(record, other); });
                             }) &&
         std::ranges::all_of(again, [&](const Record& record) {
           return !track.counts(record) || has_each(stored, [&](const Record& other) {
             return other.frame == record.frame && other.body == record.body;
           });
         });
}

/// Reads the stored records of one case, without times.
std::vector<Record> stored_records(const CheckedSweep& sweep, uint64_t number) {
  uint64_t first = 0, line = 0;
  for (uint64_t i = 0; i < number; ++i) first += sweep.n_records[i];
  std::vector<Record> records;
  for_each_record(sweep.folder / "records.jsonl", [&](Record& record) {
    if (line >= first && line < first + sweep.n_records[number])
      records.push_back(strip_times(std::move(record)));
    ++line;
  });
  return records;
}

/// Runs the case again.
std::vector<Record> run_again(const CheckedSweep& checked, uint64_t number, const VerifyOptions& options) {
  const Json entry = checked.plan.at("estimators").at(0);
  Plan plan = checked.expected;
  const PlanCase one = plan.at(number);
  plan.sources = {plan.sources[one.source]};
  plan.levels = {plan.levels[one.level]};
  plan.seeds = {one.seed};
  PlanEstimator& estimator = plan.estimators.front();
  estimator.name = entry.at("name").get<std::string>();
  estimator.label = entry.at("label").get<std::string>();
  estimator.options = entry.value("options", Json::object());
  estimator.estimator = make_case_estimator(estimator.name, estimator.options);
  const ScratchFolder scratch("sextant-verify-");
  SweepConfig config = options.sweep;
  config.plan = std::move(plan);
  config.out = scratch.path() / "case";
  config.quiet = true;
  sextant::sweep(config);
  std::vector<Record> records = read_records(config.out / "records.jsonl");
  for (Record& record : records) record = strip_times(std::move(record));
  return records;
}

/// Runs a sample of cases again and compares their records. The sample follows from the hashes of the
/// records, so that it is the same for everyone who verifies this card, but cannot be chosen beforehand.
void check_sample(const std::vector<CheckedSweep>& sweeps, const Json& stored, const VerifyOptions& options,
                  std::vector<std::string>& lines) {
  const std::string name = sweeps.front().plan.at("estimators").at(0).at("name").get<std::string>();
  if (is_of_a_kind(name) && !options.run_external) {
    lines.push_back(
        fmt::format("no case was run again: {} is a program of its own (--run-external runs it)", name));
    return;
  }
  const std::string key = sha256(json_line(stored.at("sweeps")));
  constexpr int n_rerun = 5;
  for (int i = 0; i < n_rerun; ++i) {
    const uint64_t draw = std::stoull(sha256(fmt::format("{} {}", key, i)).substr(0, 15), nullptr, 16);
    const CheckedSweep& part = sweeps[draw % sweeps.size()];
    const uint64_t number = draw / sweeps.size() % part.n_records.size();
    if (!agree(stored_records(part, number), run_again(part, number, options), *part.track))
      fail("{}: case {} gives other records when it is run again", (part.folder / "records.jsonl").string(),
           number);
    lines.push_back(fmt::format("{}: case {} was run again and gives the same records", part.name, number));
  }
}

}  // namespace

std::vector<std::string> verify_benchmark(const fs::path& folder, const VerifyOptions& options) {
  const fs::path file = folder / "card.json";
  const std::string text = read_file(file, json_file);
  const Card card = parse_card(text, file.string());
  const Suite suite = find_suite(options.suite.empty() ? card.suite : options.suite);
  if (card.suite_sha256 != suite.sha256)
    fail("{}: belongs to another suite '{}': its SHA-256 is {}, that of this program's suite {}",
         file.string(), card.suite, card.suite_sha256, suite.sha256);
  std::vector<std::string> lines;
  const std::vector<CheckedSweep> sweeps = check_sweeps(suite, card, folder, options.data_root, lines);
  uint64_t n_cases = 0;
  for (const CheckedSweep& part : sweeps) n_cases += part.n_records.size();
  lines.push_back(fmt::format("{} sweeps, {} cases: complete, with the levels and seeds of {}", sweeps.size(),
                              n_cases, suite.name));
  if (card.quick) lines.push_back("a quick run, with one seed and few levels: not for publication");
  const Json stored = parse_json(text, file.string());
  check_card(suite, stored, folder);
  lines.push_back("the card agrees with the records to the last digit");
  if (!sweeps.empty()) check_sample(sweeps, stored, options, lines);
  return lines;
}

}  // namespace sextant
