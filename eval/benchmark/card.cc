#include "sextant/eval/benchmark/card.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/base/text.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/experiment/sweep_folder.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/noise_tables.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/summary.h"

namespace sextant {

// ---- breakdown level

namespace {

/// Frame pairs of one cluster at one level.
struct SeedFrameCell {
  double n_truth = 0, n_estimated = 0, error_sum = 0;

  void add(const SeedFrameCell& more) {
    n_truth += more.n_truth;
    n_estimated += more.n_estimated;
    error_sum += more.error_sum;
  }
};

/// Indexed as cells[level][cluster].
struct Grid {
  std::vector<double> levels;
  std::vector<std::vector<SeedFrameCell>> cells;
  size_t n_clusters = 0;
};

Grid grid_of(const std::map<double, NoiseLevel>& levels, size_t error) {
  std::set<uint64_t> seeds, frames;
  for (const auto& [at, level] : levels) {
    for (size_t row = 0; row < level.n_rows(); ++row) {
      const auto [seed, frame] = level.case_of(row);
      seeds.insert(seed);
      frames.insert(static_cast<uint64_t>(frame));
    }
  }
  const bool by_seed = seeds.size() >= min_seed_clusters;
  const std::set<uint64_t>& labels = by_seed ? seeds : frames;
  Grid grid{.n_clusters = labels.size()};
  for (const auto& [at, level] : levels) {
    grid.levels.push_back(at);
    std::vector<SeedFrameCell>& cells = grid.cells.emplace_back(grid.n_clusters);
    for (size_t row = 0; row < level.n_rows(); ++row) {
      const auto [seed, frame] = level.case_of(row);
      const double value = level.error(error, row);
      const auto label = labels.find(by_seed ? seed : static_cast<uint64_t>(frame));
      cells[static_cast<size_t>(std::distance(labels.begin(), label))].add(
          {1, std::isnan(value) ? 0.0 : 1.0, std::isnan(value) ? 0 : value});
    }
  }
  return grid;
}

struct Limits {
  double nominal = 0, error_ratio = 2, min_coverage = 0.9;
};

struct Crossing {
  BreakdownCause cause = BreakdownCause::none;
  double level = 0;
};

/// Abscissa at which the line from (a, value_a) to (b, value_b) reaches `limit`.
double crossing(double a, double value_a, double b, double value_b, double limit) {
  return value_b == value_a ? b : a + (b - a) * (limit - value_a) / (value_b - value_a);
}

Crossing find_crossing(const Grid& grid, std::span<const size_t> clusters, const Limits& limits) {
  std::optional<double> nominal_error;
  std::optional<double> before_level, before_error, before_coverage;
  for (size_t i = 0; i < grid.levels.size(); ++i) {
    if (grid.levels[i] < limits.nominal) continue;
    SeedFrameCell sum;
    for (const size_t cluster : clusters) sum.add(grid.cells[i][cluster]);
    if (sum.n_truth == 0) continue;  // none of the resampled frames exists at this level
    const double level = grid.levels[i], coverage = sum.n_estimated / sum.n_truth;
    const std::optional<double> error =
        sum.n_estimated > 0 ? std::optional(sum.error_sum / sum.n_estimated) : std::nullopt;
    if (!nominal_error) {
      if (coverage < limits.min_coverage || !error) return {BreakdownCause::nominal, limits.nominal};
      nominal_error = error;
    } else {
      Crossing found{BreakdownCause::none, level};
      const double limit = limits.error_ratio * *nominal_error;
      if (error && *error >= limit)
        found = {BreakdownCause::error, crossing(*before_level, *before_error, level, *error, limit)};
      if (coverage < limits.min_coverage || !error) {
        const double at = crossing(*before_level, *before_coverage, level, coverage, limits.min_coverage);
        if (found.cause == BreakdownCause::none || at < found.level) found = {BreakdownCause::coverage, at};
      }
      if (found.cause != BreakdownCause::none) return found;
    }
    std::tie(before_level, before_error, before_coverage) = std::tuple(level, error, coverage);
  }
  return {BreakdownCause::none, grid.levels.back()};
}

}  // namespace

std::string BreakdownLevel::text() const {
  if (cause == BreakdownCause::nominal) return "at nominal";
  return cause == BreakdownCause::none ? fmt::format("> {:g}", highest) : fmt::format("{:.3g}", level);
}

std::string BreakdownLevel::interval_text() const {
  if (!interval) return "";
  const auto end = [&](double at) {
    return at >= highest ? fmt::format("> {:g}", highest) : fmt::format("{:.3g}", at);
  };
  return fmt::format("[{}, {}]", end(interval->low), end(interval->high));
}

BreakdownLevel breakdown_of(const std::map<double, NoiseLevel>& levels, size_t error, double nominal,
                            double error_ratio, double min_coverage) {
  SEXTANT_CHECK(!levels.empty());
  const Grid grid = grid_of(levels, error);
  const Limits limits{nominal, error_ratio, min_coverage};
  std::vector<size_t> all(grid.n_clusters);
  std::iota(all.begin(), all.end(), size_t{0});
  const Crossing found = find_crossing(grid, all, limits);
  BreakdownLevel out{nominal, grid.levels.back(), found.cause, found.level, std::nullopt};
  out.interval = cluster_bootstrap(
      grid.n_clusters,
      [&](std::span<const size_t> chosen) { return find_crossing(grid, chosen, limits).level; },
      {.method = BootstrapMethod::percentile});
  return out;
}

// ---- card

namespace {

constexpr std::string_view speed_error = "Ev_kmh";

/// Errors of a level: those that noise reports compare, the speed error, and the metric of the suite.
std::vector<Interned> error_names(const Suite& suite) {
  std::vector<Interned> names = compared_names();
  names.emplace_back(speed_error);
  add_distinct(suite.metric, names);
  return names;
}

/// Key of a curve: result, index of the track, kind of body.
using CurveKey = std::tuple<std::string, size_t, BodyKind>;
struct Curve {
  std::map<double, NoiseLevel> levels;
  std::map<double, std::string> files;  ///< with the records of each level
};
using Curves = std::map<CurveKey, Curve>;

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

/// Returns the mean of the smallest errors, over the share `share` of the pairs with truth. Returns nullopt
/// if fewer pairs were estimated.
std::optional<double> mean_of_best(const NoiseLevel& level, size_t error, double share) {
  std::vector<double> values;
  for (size_t row = 0; row < level.n_rows(); ++row) {
    if (const double value = level.error(error, row); !std::isnan(value)) values.push_back(value);
  }
  const auto n_best = static_cast<size_t>(std::ceil(share * static_cast<double>(level.n_truth()) - 1e-9));
  if (n_best == 0 || values.size() < n_best) return std::nullopt;
  std::ranges::sort(values);
  values.resize(n_best);
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(n_best);
}

CurvePoint summarize(const CurveKey& key, const SuiteTrack& track, const Suite& suite, double level,
                     const NoiseLevel& errors, const std::string& file) {
  CurvePoint point{.estimator = std::get<0>(key),
                   .track = track.name,
                   .body = std::string(to_string(std::get<2>(key))),
                   .level = level,
                   .is_nominal = level == track.nominal,
                   .n_seeds = static_cast<int>(errors.n_seeds()),
                   .n_truth = static_cast<int>(errors.n_truth()),
                   .n_estimated = static_cast<int>(errors.n_estimated()),
                   .records = file};
  point.Et_m = mean_of(errors, "Et_m");
  point.ER_deg = mean_of(errors, "ER_deg");
  point.Ev_kmh = mean_of(errors, speed_error);
  point.best_Et_m = mean_of_best(errors, compared_error("Et_m"), suite.min_coverage);
  const LimitSummary limit = summarize_limit(errors, {});
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
      : errors_(error_names(suite)), suite_(suite), folder_(folder), card_(card) {}

  void read(size_t track, const SuiteSweep& sweep) {
    const fs::path folder = folder_ / sweep.name;
    const Json plan_file = read_plan_file(folder);
    const std::string where = (folder / "plan.json").string();
    if (shard_number(plan_file, where).n_shards != 1)
      fail("{}: it is one of several shards: join them with sextant benchmark merge", where);
    if (!fs::exists(folder / "records.jsonl"))
      fail("{}: the sweep is not finished: run it again", folder.string());
    take_estimator(plan_file, where);
    CardSweep& part = card_.sweeps.emplace_back(CardSweep{suite_.tracks[track].name, sweep.name});
    part.n_cases = planned_cases(plan_file["plan"], where);
    records_by_case(folder);  // throws Error if records are missing
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

  Curves take_curves() { return std::move(curves_); }

  std::vector<Cost> costs() const {
    std::vector<Cost> rows;
    const std::string machines = fmt::format("{}", fmt::join(machines_, "; "));
    for (const auto& [result, samples] : costs_) {
      Cost& cost = rows.emplace_back(Cost{.estimator = result, .machine = machines});
      if (!samples.ms.empty()) cost.median_ms = median(samples.ms);
      if (samples.peak_memory_mb > 0) cost.peak_memory_mb = samples.peak_memory_mb;
    }
    return rows;
  }

 private:
  /// A card is of one estimator: all sweeps have the same name, label, options and version.
  void take_estimator(const Json& plan_file, const std::string& where) {
    const Json estimators = json_list(plan_file["plan"], "estimators", where);
    if (estimators.size() != 1) fail("{}: expected one estimator, found {}", where, estimators.size());
    Json estimator = estimators[0];
    card_.estimator = json_member<std::string>(estimator, "label", where);
    card_.plan_estimator = json_member<std::string>(estimator, "name", where);
    card_.options = json_object(estimator, "options", where);
    for (const char* own_front_end : {"extraction", "pipeline"}) {
      if (estimator.contains(own_front_end))
        fail("{}: the estimator has its own '{}': expected that of the suite", where, own_front_end);
    }
    const Fingerprints versions = fingerprints_in(plan_file, where);
    if (const auto* of_label = find_in(versions, card_.estimator); of_label != nullptr) {
      if (of_label->size() != 1)
        fail("{}: {} versions of '{}' made its cases: run them again without --reuse-stale or --allow-mixed",
             where, of_label->size(), card_.estimator);
      card_.fingerprint = of_label->front().sha256();
    } else {
      card_.fingerprint.clear();
    }
    estimator["version"] = card_.fingerprint;
    if (estimator_.is_null()) {
      estimator_ = estimator;
      first_plan_ = where;
    }
    for (const char* key : {"label", "name", "options", "version"}) {
      if (estimator[key] != estimator_[key])
        fail("{}: the {} of its estimator '{}' differs from that in {}: expected one estimator; run it again",
             where, key, card_.estimator, first_plan_);
    }
  }

  void add(size_t track, const std::string& file, const Record& record) {
    const std::string result = record.estimator;
    costs_[result].add(record);
    if (!suite_.tracks[track].counts(record)) return;
    Curve& curve = curves_[{result, track, kind_of(record)}];
    curve.levels.try_emplace(record.level, NoiseLevelKey{}, errors_).first->second.add(record);
    curve.files[record.level] = file;
  }

  std::vector<Interned> errors_;
  const Suite& suite_;
  const fs::path& folder_;
  Card& card_;
  Curves curves_;
  std::map<std::string, CostSamples> costs_;
  std::set<std::string> machines_;
  Json estimator_;          ///< of the first sweep: label, name, options, version
  std::string first_plan_;  ///< plan file of the first sweep
};

}  // namespace

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

namespace {

/// Returns true if the names of the plans mark the sweeps in FOLDER/<sweep>/ as a quick run. Throws Error if
/// there are none.
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
  const std::vector<Interned> errors = error_names(suite);
  const auto metric = static_cast<size_t>(std::ranges::find(errors, Interned(suite.metric)) - errors.begin());
  for (auto& [key, curve] : reader.take_curves()) {
    const SuiteTrack& track = suite.tracks[std::get<1>(key)];
    if (curve.levels.size() > 1)
      card.breakdowns.push_back(
          {std::get<0>(key), track.name, std::string(to_string(std::get<2>(key))),
           breakdown_of(curve.levels, metric, track.nominal, suite.error_ratio, suite.min_coverage)});
    for (auto& [level, of_level] : curve.levels) {
      of_level.sort();
      card.curves.push_back(summarize(key, track, suite, level, of_level, curve.files.at(level)));
    }
    const CurvePoint& last = card.curves.back();
    if (std::ranges::find(card.results, last.estimator) == card.results.end())
      card.results.push_back(last.estimator);
  }
  card.costs = reader.costs();
  return card;
}

void check_suite(const Card& card, const Suite& suite, const fs::path& folder) {
  if (card.suite_sha256 != suite.sha256)
    fail(
        "{}: belongs to another suite '{}': its SHA-256 is {}, that of the suite {} is {}: give --suite "
        "NAME.json",
        (folder / "card.json").string(), card.suite, card.suite_sha256, suite.name, suite.sha256);
}

Suite suite_of(const Card& card, const std::string& requested, const fs::path& folder) {
  Suite suite = requested.empty() ? own_suite(card.suite) : find_suite(requested);
  check_suite(card, suite, folder);
  return suite;
}

std::vector<std::string> card_notes(const Card& card) {
  std::vector<std::string> notes;
  for_each_leaf(card.options, /*enters_lists=*/false, [&](const std::string& key, const Json& value) {
    if (key == "write_truth" && value == true)
      notes.emplace_back("The program was given the truth of the data (option write_truth).");
    if (key.ends_with("objects.ids") && value == "overlap")
      add_distinct("The ids of its objects were matched by their true motions (option objects.ids: overlap).",
                   notes);
  });
  // The bound is that of the points of our front end: one in 300 pixels of the background, one in 9 of an
  // object. A program that uses all pixels can have errors that are 17 times smaller.
  constexpr double largest_efficiency = 20;
  constexpr int fewest_pairs = 10;
  const CurvePoint* best = nullptr;
  for (const CurvePoint& point : card.curves) {
    if (!point.efficiency || point.efficiency->value <= largest_efficiency ||
        point.n_estimated < fewest_pairs)
      continue;
    if (best == nullptr || point.efficiency->value > best->efficiency->value) best = &point;
  }
  if (best != nullptr)
    notes.push_back(fmt::format(
        "Efficiency {:.3g} (track {}, {}, level {:g}): no estimate from the noisy data alone can be this "
        "accurate.",
        best->efficiency->value, best->track, best->body, best->level));
  return notes;
}

}  // namespace sextant
