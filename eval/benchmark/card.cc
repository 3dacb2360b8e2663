#include "sextant/eval/benchmark/card.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/eval/benchmark/breakdown.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/errors_by_level.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr std::string_view speed_error = "Ev_kmh";

/// Errors of a level: those that noise reports compare, and the speed error.
std::vector<Interned> error_names() {
  std::vector<Interned> names = compared_names();
  names.emplace_back(speed_error);
  return names;
}

/// Data of one level of a curve, before they are summarised.
struct Pool {
  NoiseLevel errors{NoiseLevelKey{}, error_names()};
  LevelCounts counts;
  std::string file;

  Pool() = default;
  void add(const Record& record, Interned metric) {
    errors.add(record);
    const auto error = record.status == Status::ok ? find_number(record.errors, metric) : std::nullopt;
    counts.add(record.seed, record.frame, error);
  }
};

/// Key of a curve: result, index of the track, kind of body.
using CurveKey = std::tuple<std::string, size_t, BodyKind>;  // result, index of the track, kind
using Curves = std::map<CurveKey, std::map<double, Pool>>;

/// Times of frame pairs and memory of one result.
struct CostSamples {
  std::vector<double> ms;
  double peak_memory_mb = 0;

  /// The records of a pair begin with that of the camera.
  void add(const Record& record) {
    if (record.is_ego()) ms.push_back(0);
    if (const auto time = find_number(record.time_ms, "total"); time && !ms.empty()) ms.back() += *time;
    peak_memory_mb = std::max(peak_memory_mb, find_number(record.values, "peak_memory_mb").value_or(0.0));
  }
};

/// Returns the clusters of the bootstrap: frames if there are fewer than min_seed_clusters seeds, which would
/// be too few clusters.
ClusterBy clusters_of(const NoiseLevel& level) {
  return level.n_seeds() < min_seed_clusters ? ClusterBy::frames : ClusterBy::seeds;
}

std::optional<IntervalEstimate> mean_of(const NoiseLevel& level, std::string_view error) {
  const size_t index = error == speed_error ? compared_names().size() : compared_error(error);
  if (!level.has(index)) return std::nullopt;
  const std::vector<Moments> clusters = joined_sums(level.sums(index, clusters_of(level)));
  return cluster_estimate(clusters.size(),
                          [&](std::span<const size_t> chosen) { return total(clusters, chosen).mean(); });
}

CurvePoint summarize(const CurveKey& key, const SuiteTrack& track, const Suite& suite, double level,
                     const Pool& pool) {
  CurvePoint point{.estimator = std::get<0>(key),
                   .track = track.name,
                   .body = std::string(to_string(std::get<2>(key))),
                   .level = level,
                   .is_nominal = level == track.nominal,
                   .n_seeds = static_cast<int>(pool.errors.n_seeds()),
                   .n_truth = static_cast<int>(pool.errors.n_truth()),
                   .n_estimated = static_cast<int>(pool.errors.n_estimated()),
                   .records = pool.file};
  point.Et_m = mean_of(pool.errors, "Et_m");
  point.ER_deg = mean_of(pool.errors, "ER_deg");
  point.Ev_kmh = mean_of(pool.errors, speed_error);
  const LimitSummary limit = summarize_limit(pool.errors, {});
  if (const Efficiency* efficiency = find_in(limit.efficiency, suite.metric))
    point.efficiency = IntervalEstimate{efficiency->efficiency, efficiency->interval};
  if (limit.consistency) {
    point.anees = limit.consistency->anees;
    point.anees_expected = limit.consistency->expected;
  }
  return point;
}

/// Reads the records of one sweep into the curves of its track.
class SweepReader {
 public:
  SweepReader(const Suite& suite, const fs::path& folder, Card& card)
      : metric_(suite.metric), suite_(suite), folder_(folder), card_(card) {}

  void read(size_t track, const SuiteSweep& sweep) {
    const fs::path folder = folder_ / sweep.name;
    const Json plan_file = read_plan_file(folder);
    const std::string where = (folder / "plan.json").string();
    if (shard_number(plan_file, where).n_shards != 1)
      fail("{}: it is one of several shards: join them with sextant benchmark merge", where);
    if (!fs::exists(folder / "records.jsonl"))
      fail("{}: the sweep is not finished: run it again", folder.string());
    take_estimator(plan_file["plan"], where);
    CardSweep& part = card_.sweeps.emplace_back(CardSweep{suite_.tracks[track].name, sweep.name});
    part.n_cases = planned_cases(plan_file["plan"], where);
    std::string stripped;
    for_each_record(folder / "records.jsonl", [&](Record& record) {
      ++part.n_records;
      add(track, sweep.name + "/records.jsonl", record);
      stripped += json_line(to_json(strip_times(std::move(record)))) + "\n";
    });
    part.records_sha256 = sha256(stripped);
    const Json machine = read_run_json(folder).value("machine", Json::object());
    machines_.insert(fmt::format("{}, {} cores", machine.value("cpu", "unknown"), machine.value("cores", 0)));
  }

  const Curves& curves() const { return curves_; }

  std::vector<Cost> costs() const {
    std::vector<Cost> rows;
    std::string machines;
    for (const std::string& machine : machines_) machines += (machines.empty() ? "" : "; ") + machine;
    for (const auto& [result, samples] : costs_) {
      Cost& cost = rows.emplace_back(Cost{.estimator = result, .machine = machines});
      if (!samples.ms.empty()) cost.median_ms = median(samples.ms);
      if (samples.peak_memory_mb > 0) cost.peak_memory_mb = samples.peak_memory_mb;
    }
    return rows;
  }

 private:
  void take_estimator(const Json& plan, const std::string& where) {
    const Json estimators = json_list(plan, "estimators", where);
    if (estimators.size() != 1) fail("{}: expected one estimator, found {}", where, estimators.size());
    const auto label = json_member<std::string>(estimators[0], "label", where);
    if (!card_.estimator.empty() && label != card_.estimator)
      fail("{}: belongs to estimator '{}', but other sweeps belong to '{}'", where, label, card_.estimator);
    card_.estimator = label;
    card_.plan_estimator = json_member<std::string>(estimators[0], "name", where);
  }

  void add(size_t track, const std::string& file, const Record& record) {
    const std::string result = record.estimator;
    costs_[result].add(record);
    if (!suite_.tracks[track].counts(record)) return;
    Pool& pool = curves_[{result, track, kind_of(record)}][record.level];
    pool.add(record, metric_);
    pool.file = file;
  }

  Interned metric_;
  const Suite& suite_;
  const fs::path& folder_;
  Card& card_;
  Curves curves_;
  std::map<std::string, CostSamples> costs_;
  std::set<std::string> machines_;
};

/// Reads left_out.json of the folder, {"TRACK": "reason"}; empty if it does not exist.
std::map<std::string, std::string> left_out_of(const Suite& suite, const fs::path& folder) {
  std::map<std::string, std::string> reasons;
  const fs::path file = folder / left_out_name;
  if (!fs::exists(file)) return reasons;
  const Json json = read_json(file);
  if (!json.is_object()) fail("{}: expected an object of tracks, got {}", file.string(), json_excerpt(json));
  for (const auto& item : json.items())
    reasons[suite.track(item.key()).name] = json_member<std::string>(json, item.key(), file.string());
  return reasons;
}

/// Returns true if the names of the plans mark the sweeps of the folder as a quick run.
bool is_quick_run(const Suite& suite, const fs::path& folder) {
  for (const SuiteTrack& track : suite.tracks) {
    for (const SuiteSweep& sweep : track.sweeps) {
      const fs::path of_sweep = folder / sweep.name;
      if (!fs::exists(of_sweep / "plan.json")) continue;
      const std::string where = (of_sweep / "plan.json").string();
      return json_member<std::string>(read_plan_file(of_sweep)["plan"], "name", where)
          .ends_with(quick_ending);
    }
  }
  fail("{}: holds no sweep of suite {}", folder.string(), suite.name);
}

}  // namespace

const CurvePoint* Card::find_point(const std::string& result, const std::string& track,
                                   const std::string& body, double level) const {
  const auto at = std::ranges::find_if(curves, [&](const CurvePoint& p) {
    return p.estimator == result && p.track == track && p.body == body && p.level == level;
  });
  return at == curves.end() ? nullptr : &*at;
}

Card make_card(const Suite& suite, const fs::path& folder) {
  Card card{.suite = suite.name,
            .suite_sha256 = suite.sha256,
            .quick = is_quick_run(suite, folder),
            .program = program_identity(),
            .left_out = left_out_of(suite, folder)};
  SweepReader reader(suite, folder, card);
  for (size_t track = 0; track < suite.tracks.size(); ++track) {
    if (card.left_out.contains(suite.tracks[track].name)) continue;
    for (const SuiteSweep& sweep : suite.tracks[track].sweeps) {
      if (!plan_text(suite, suite.tracks[track], sweep, "", card.quick).empty()) reader.read(track, sweep);
    }
  }
  if (card.sweeps.empty()) fail("{}: holds no sweep of suite {}", folder.string(), suite.name);
  for (const auto& [key, curve] : reader.curves()) {
    const SuiteTrack& track = suite.tracks[std::get<1>(key)];
    std::vector<LevelCounts> counts;
    for (const auto& [level, pool] : curve) {
      Pool sorted = pool;
      sorted.errors.sort();
      card.curves.push_back(summarize(key, track, suite, level, sorted));
      counts.push_back(pool.counts);
      counts.back().level = level;
    }
    const CurvePoint& last = card.curves.back();
    if (counts.size() > 1)
      card.breakdowns.push_back({last.estimator, last.track, last.body,
                                 breakdown_of(counts, track.nominal, suite.error_ratio, suite.min_coverage)});
    if (std::ranges::find(card.results, last.estimator) == card.results.end())
      card.results.push_back(last.estimator);
  }
  card.costs = reader.costs();
  return card;
}

}  // namespace sextant
