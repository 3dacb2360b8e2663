#include "sextant/eval/benchmark/benchmark_verification.h"

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <tuple>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/new_file.h"
#include "sextant/base/text.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/benchmark/benchmark_run.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/benchmark/card_document.h"
#include "sextant/eval/benchmark/record_comparison.h"
#include "sextant/eval/benchmark/suite.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/experiment/evaluate_pair.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

/// A source of a plan, with the bodies that every estimator must have a record of and their true values.
struct CheckedSource {
  SequenceInfo info;
  std::vector<std::pair<int, Interned>> counted;  ///< frame and body, of all that the track counts
  std::map<std::pair<int, Interned>, Record::Numbers> truth;  ///< values of every frame and true body
};

/// A sweep of the submission, with the plan that the suite requires.
struct CheckedSweep {
  const SuiteTrack* track = nullptr;
  std::string name;
  fs::path folder;
  Json programs;  ///< program_identity() of each program that ran its cases
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

/// Refuses the values of a record that only an estimate with a covariance can have.
void refuse_covariances(const Record& record, const std::function<void(const std::string&)>& refuse) {
  for (const char* name : {"nees", "split_nees", "split_nees_sides", "split_nees_cells", "condition",
                           "motion_sigmas", "detectable_kmh"}) {
    if (record.values.contains(name))
      refuse(fmt::format("frame {}, body {}: has values.{}, but an external program gives no covariances",
                         record.frame, record.body.str(), name));
  }
}

/// Checks that every record has the data, frames, level, noise, seed and estimator of its case and the true
/// values of the data, that no record of an external program has values of a covariance, and that the records
/// of a case are one for each result of the card, frame and body that the track counts. Further records are
/// of bodies that do not count.
void check_records(const CheckedSweep& sweep, const Card& card) {
  using Key = std::tuple<Interned, int, Interned>;  // estimator, frame, body
  const fs::path file = sweep.folder / "records.jsonl";
  uint64_t in_case = 0, number = 0, line = 0;
  std::set<Key> seen, missing;
  // An object needs a speed error if the motion of the camera is estimated, whose record may follow. Both by
  // estimator and frame; the texts refuse objects without speed error.
  std::set<std::pair<Interned, int>> has_camera;
  std::map<std::pair<Interned, int>, std::string> without_speed;
  const auto begin_case = [&] {
    seen.clear();
    has_camera.clear();
    without_speed.clear();
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
      for (const auto& [pair, text] : without_speed)
        if (has_camera.contains(pair)) throw Error(text);
      in_case = 0;
      if (++number < sweep.n_records.size()) begin_case();
    }
  };
  begin_case();
  end_finished_cases();
  for_each_record(file, [&](Record& record) {
    ++line;
    const PlanCase expected = sweep.expected.at(number);
    const PlanLevel& level = sweep.expected.levels[expected.level];
    const auto refusal = [&](const std::string& what) {
      return fmt::format("{}:{}: record of case {}: {}", file.string(), line, number, what);
    };
    const auto refuse = [&](const std::string& what) { throw Error(refusal(what)); };
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
    if (source) {
      const auto truth = source->truth.find({record.frame, record.body});
      const std::string text = truth == source->truth.end() ? "" : difference_of_truth(record, truth->second);
      if (!text.empty()) refuse(fmt::format("frame {}, body {}: {}", record.frame, record.body.str(), text));
    }
    if (card.plan_estimator.starts_with(external_prefix)) refuse_covariances(record, refuse);
    // A record with status no_truth may count because of the errors of its flow; its motion has none.
    const bool counts = sweep.track->counts(record) && record.status != Status::no_truth;
    if (counts && missing.erase(key) == 0 && source)
      refuse(fmt::format("frame {}, body {}: has no truth in the data", record.frame, record.body.str()));
    if (record.is_ego() && record.status == Status::ok) has_camera.emplace(record.estimator, record.frame);
    if (counts && record.status == Status::ok) {
      const auto without = [&](const char* error) {
        return fmt::format("frame {}, body {}: status ok, but the error {} is missing", record.frame,
                           record.body.str(), error);
      };
      for (const char* error : {"Et_m", "ER_deg"})
        if (!record.errors.contains(error)) refuse(without(error));
      if (!record.is_ego() && !record.errors.contains("Ev_kmh"))
        without_speed.emplace(std::pair(record.estimator, record.frame), refusal(without("Ev_kmh")));
    }
    ++in_case;
    end_finished_cases();
  });
}

/// Returns the source with the frames and bodies that the track counts and with the values of the truth, from
/// the records of an estimator that estimates nothing.
CheckedSource checked_source(const Sequence& sequence, const SuiteTrack& track) {
  const SequenceInfo& info = sequence.info();
  CheckedSource source{.info = info};
  for (int frame = info.first_frame + 1; frame <= info.last_frame; ++frame) {
    FrameResult nothing{.prev = frame - 1, .curr = frame, .dt_s = 1.0 / info.rate_hz};
    nothing.ego.status = Status::lost;
    const PairContext context{.identity = {.dataset = info.dataset, .sequence = info.sequence},
                              .camera = info.camera.left,
                              .truth = sequence.truth(),
                              .estimated = Trajectory()};
    for (const Record& record : evaluate_pair(nothing, context)) {
      if (track.counts(record)) source.counted.emplace_back(record.frame, record.body);
      source.truth[{record.frame, record.body}] = record.values;
    }
  }
  return source;
}

/// Opens the sources of a plan. Data that are missing here are no fault of the submission.
std::vector<std::optional<CheckedSource>> open_sources(const Plan& plan, const SuiteTrack& track) {
  std::vector<std::optional<CheckedSource>> sources;
  for (const SourceSpec& spec : plan.sources) {
    std::optional<CheckedSource>& source = sources.emplace_back();
    try {
      source = checked_source(*open_source(spec), track);
    } catch (const Error&) {
      continue;
    }
  }
  return sources;
}

/// Compares a sweep of the folder with the plan that the suite requires. If its data are not available, only
/// the keys of the records are checked.
CheckedSweep check_plan(const Suite& suite, const SuiteTrack& track, const std::string& name, Plan expected,
                        const Card& card, const fs::path& folder) {
  CheckedSweep sweep{.track = &track, .name = name, .folder = folder / name, .expected = std::move(expected)};
  const Json plan_file = read_plan_file(sweep.folder), plan = plan_file["plan"];
  const std::string where = (sweep.folder / "plan.json").string();
  sweep.programs = json_list(plan_file, "programs", where);
  if (cases_key(plan) != cases_key(sweep.expected.json()))
    fail("{}: its sources, noise, seeds or options are not those of {}: {}", where, suite.name, name);
  const Json estimators = json_list(plan, "estimators", where);
  if (estimators.size() != 1 || json_member<std::string>(estimators[0], "label", where) != card.estimator)
    fail("{}: belongs to another estimator than the card, '{}'", where, card.estimator);
  sweep.sources = open_sources(sweep.expected, track);
  sweep.n_records = records_by_case(sweep.folder);
  if (sweep.n_records.size() != sweep.expected.n_cases())
    fail("{}: holds {} cases, the suite has {}: its sweep is not finished, or was changed",
         (sweep.folder / "cases.jsonl").string(), sweep.n_records.size(), sweep.expected.n_cases());
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
      const std::string text = plan_text(suite, track, part, "joint_flow", card.quick);
      if (text.empty()) continue;
      std::optional<Plan> expected;
      try {
        expected = parse_plan(text, suite.name + ": " + part.name, data_root);
      } catch (const Error& error) {
        if (!track.needs_data) throw;
        lines.push_back(
            fmt::format("{}: not checked, because its data are missing here: {}", part.name, error.what()));
        continue;
      }
      sweeps.push_back(check_plan(suite, track, part.name, std::move(*expected), card, folder));
      check_records(sweeps.back(), card);
    }
  }
  return sweeps;
}

/// Returns the first key in which two JSON values differ: "curves.3.Et_m".
std::string first_difference(const Json& a, const Json& b, const std::string& path = "") {
  if (a.type() != b.type() || !a.is_structured() || (a.is_array() && a.size() != b.size())) return path;
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
  for (const auto& item : b.items()) {
    if (b.is_object() && !a.contains(item.key())) return path.empty() ? item.key() : path + "." + item.key();
  }
  return path;
}

/// Checks that card.json is the card of the records, and card.md that of card.json.
void check_card(const Suite& suite, const Card& card, const Card& computed, Json given,
                const fs::path& folder, std::vector<std::string>& lines) {
  Json expected = to_json(computed);
  expected.erase("program");
  given.erase("program");
  if (expected != given)
    fail(
        "{}: the value of '{}' does not agree with the records: if the card was written by an older version, "
        "write it again with sextant benchmark card",
        (folder / "card.json").string(), first_difference(given, expected));
  lines.emplace_back("card.json agrees with the records to the last digit");
  const fs::path text = folder / "card.md";
  const bool is_of_this_program = card.program == program_identity();
  if (is_of_this_program && fs::exists(text) &&
      read_file(text) != to_markdown(card_document(card, suite, reference_cards(suite))))
    fail("{}: does not agree with card.json: write both again with sextant benchmark card", text.string());
  if (!is_of_this_program)
    lines.push_back(fmt::format("the card was written by Sextant {}, this is {}: card.md is not checked",
                                program_text(Json::array({card.program})),
                                program_text(Json::array({program_identity()}))));
  lines.emplace_back("not checked: card.html, and the machine, program and times that the folder states");
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

/// Returns the estimator of the card.
PlanEstimator estimator_of(const Card& card) {
  PlanEstimator estimator{.name = card.plan_estimator, .label = card.estimator, .options = card.options};
  estimator.options.erase("recorded");  // would let a plan stand for a CONFIG that does not exist
  estimator.estimator = make_case_estimator(estimator.name, estimator.options);
  return estimator;
}

/// Runs the case again with another estimator than that of the expected plan.
std::vector<Record> run_again(const CheckedSweep& checked, uint64_t number, const PlanEstimator& with,
                              const VerifyOptions& options) {
  Plan plan = checked.expected;
  const PlanCase one = plan.at(number);
  plan.sources = {plan.sources[one.source]};
  plan.levels = {plan.levels[one.level]};
  plan.seeds = {one.seed};
  PlanEstimator& estimator = plan.estimators.front();
  estimator.name = with.name;
  estimator.label = with.label;
  estimator.options = with.options;
  estimator.estimator = with.estimator;
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

/// Draws cases as pairs of sweep and number, without replacement: one of every sweep and five at least, or
/// all.
std::vector<std::pair<size_t, uint64_t>> draw_sample(const std::vector<CheckedSweep>& sweeps, uint64_t seed,
                                                     bool all) {
  using Case = std::pair<size_t, uint64_t>;
  std::vector<std::pair<std::string, Case>> shuffled;
  for (size_t part = 0; part < sweeps.size(); ++part) {
    for (uint64_t number = 0; number < sweeps[part].n_records.size(); ++number)
      shuffled.push_back({sha256(fmt::format("{} {} {}", seed, part, number)), {part, number}});
  }
  std::ranges::sort(shuffled);
  std::set<size_t> parts;
  // The first case of every sweep comes first.
  std::stable_partition(shuffled.begin(), shuffled.end(),
                        [&](const auto& drawn) { return parts.insert(drawn.second.first).second; });
  constexpr size_t fewest = 5;
  if (!all) shuffled.resize(std::min(shuffled.size(), std::max(fewest, parts.size())));
  std::vector<Case> cases;
  for (const auto& [hash, drawn] : shuffled) cases.push_back(drawn);
  std::ranges::sort(cases);
  return cases;
}

uint64_t random_seed() {
  std::random_device random;
  return random();
}

BodyResult body_without_estimate(const FramePair& pair, int instance, Correspondences points) {
  BodyResult body{.instance = instance, .status = Status::diverged, .points = std::move(points)};
  body.noise = pair.noise_of(instance);
  return body;
}

class PointsOfPairs final : public PairEstimator {
 public:
  explicit PointsOfPairs(double max_depth_m) : max_depth_m_(max_depth_m) {}
  FrameResult process(const FramePair& pair) override {
    FrameResult result{.prev = pair.prev, .curr = pair.curr, .dt_s = pair.dt_s};
    result.ego = body_without_estimate(pair, 0, pair.background);
    for (const ObjectObservation& object : pair.objects)
      result.objects.push_back(body_without_estimate(
          pair, object.instance, points_of_instance(object, object.instance, max_depth_m_)));
    return result;
  }

 private:
  double max_depth_m_;
};

/// Passes on the points of every body and estimates no motion. Its records have the bounds of every estimator
/// whose bodies have the same points: those of external programs, whose objects pass no gate, and those of
/// other estimators for objects that passed the gates of the pipeline.
class PointsWithoutEstimate final : public CaseEstimator {
 public:
  std::vector<NamedEstimator> begin(const CaseContext& context) const override {
    std::vector<NamedEstimator> alone;
    alone.push_back({"", std::make_unique<PointsOfPairs>(context.pipeline.max_object_distance_m)});
    return alone;
  }
  Json options() const override { return Json::object(); }
  std::string label() const override { return "points"; }
  bool is_third_party() const override { return false; }
};

/// Runs a random sample of cases again and compares their records; of a program that is not run, the bounds.
void check_sample(const std::vector<CheckedSweep>& sweeps, const Card& card, const Suite& suite,
                  const VerifyOptions& options, std::vector<std::string>& lines) {
  const std::string& name = card.plan_estimator;
  const bool is_python = name.starts_with(python_prefix);
  const bool only_bounds = is_python || (is_of_a_kind(name) && !options.run_external);
  if (only_bounds) {
    lines.push_back(fmt::format("no case was run again: {} is {}", name,
                                is_python ? "a function of a Python process, which this program cannot call"
                                          : "a program of its own (--run-external runs it)"));
  }
  const PlanEstimator estimator =
      only_bounds ? PlanEstimator{.name = "points",
                                  .label = "points",
                                  .estimator = std::make_shared<const PointsWithoutEstimate>()}
                  : estimator_of(card);
  const uint64_t seed = options.sample_seed.value_or(random_seed());
  if (!options.all) lines.push_back(fmt::format("sample of cases: --sample-seed {} draws it again", seed));
  for (const auto& [index, number] : draw_sample(sweeps, seed, options.all)) {
    const CheckedSweep& part = sweeps[index];
    const std::string file = (part.folder / "records.jsonl").string();
    const std::vector<Record> stored = stored_records(part, number);
    const std::vector<Record> again = run_again(part, number, estimator, options);
    if (only_bounds) {
      const std::string text = difference_of_bounds(stored, again, *part.track, suite.metric);
      if (!text.empty()) fail("{}: case {}: bounds do not follow from the data: {}", file, number, text);
      lines.push_back(fmt::format("{}: the bounds of case {} follow from the data", part.name, number));
      continue;
    }
    const std::string text = difference(stored, again, *part.track, suite.metric);
    if (!text.empty())
      fail("{}: case {} gives other records when it is run again: {}; it was run by Sextant {}, this is {}",
           file, number, text, program_text(part.programs), program_text(Json::array({program_identity()})));
    lines.push_back(fmt::format("{}: case {} was run again and gives the same records", part.name, number));
  }
}

}  // namespace

std::vector<std::string> verify_benchmark(const fs::path& folder, const VerifyOptions& options) {
  const Card card = stored_card(folder);
  const Suite suite = suite_of(card, options.suite, folder);
  std::vector<std::string> lines;
  const std::vector<CheckedSweep> sweeps = check_sweeps(suite, card, folder, options.data_root, lines);
  uint64_t n_cases = 0;
  for (const CheckedSweep& part : sweeps) n_cases += part.n_records.size();
  lines.push_back(fmt::format("{} sweeps, {} cases: complete, with the levels and seeds of {}", sweeps.size(),
                              n_cases, suite.name));
  if (card.quick) lines.push_back("a quick run, with one seed and few levels: not for publication");
  // The estimator is that of the plans, which all sweeps share.
  const Card computed = make_card(suite, folder);
  check_card(suite, card, computed, read_json(folder / "card.json"), folder, lines);
  std::ranges::copy(card_notes(computed), std::back_inserter(lines));
  if (!sweeps.empty()) check_sample(sweeps, computed, suite, options, lines);
  for (std::string& line : lines) line = one_line(line);
  return lines;
}

}  // namespace sextant
