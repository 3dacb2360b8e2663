#include "sextant/eval/report/noise_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "sextant/base/machine.h"
#include "sextant/base/text.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/metrics/crlb.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/trend.h"

namespace sextant {

namespace {

/// Returns the efficiency over the records that have error and bound; nullopt if there are none, or if all
/// errors are 0.
std::optional<Efficiency> efficiency(const ClusterSums& errors, const Moments& bounds,
                                     const BootstrapOptions& options) {
  const Moments all = total(errors);
  if (all.xx == 0) return std::nullopt;
  const std::vector<Moments> seeds = joined_sums(errors);
  const auto rms = [&](std::span<const size_t> chosen) { return total(seeds, chosen).rmse(); };
  Efficiency out{bounds.rmse(), bounds.rmse() / all.rmse(), std::nullopt};
  const std::optional<Interval> interval = cluster_bootstrap(seeds.size(), rms, options);
  if (interval && interval->low > 0) out.interval = {out.bound / interval->high, out.bound / interval->low};
  return out;
}

std::optional<Consistency> consistency(const Moments& nees) {
  if (nees.n == 0) return std::nullopt;
  const int n = static_cast<int>(nees.n);
  return Consistency{nees.mean(), nees_interval(n, nees_dof), n};
}

}  // namespace

IntervalEstimate Efficiency::ratio() const {
  IntervalEstimate out{1 / efficiency, std::nullopt};
  if (interval && interval->low > 0) out.interval = {1 / interval->high, 1 / interval->low};
  return out;
}

std::vector<const MetricDefinition*> bounded_errors() {
  std::vector<const MetricDefinition*> bounded = metrics_for(compared);
  std::erase_if(bounded, [](const MetricDefinition* m) { return !find_metric(NumberMap::bound, m->name); });
  return bounded;
}

LimitSummary summarize_limit(const NoiseLevel& level, const BootstrapOptions& options) {
  LimitSummary limit;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    const auto [errors, bounds] = level.bounded(e);
    if (const auto value = efficiency(errors, bounds, options))
      limit.efficiency[compared_errors()[e]->name] = *value;
  }
  limit.consistency = consistency(level.nees());
  return limit;
}

Fields<LimitSummary> limit_fields() {
  Fields<LimitSummary> fields;
  for (const MetricDefinition* error : bounded_errors()) {
    const std::string key = error->stem() + "_efficiency";
    Fields<Efficiency> of_error = {
        {Column::number(error->key("bound"), metric(NumberMap::bound, error->name).heading(),
                        error->digits + 1),
         &Efficiency::bound},
        {Column::number(key, "efficiency", 3), &Efficiency::efficiency}};
    of_error.add_range(range_columns(key + "_low", key + "_high", 3), &Efficiency::interval);
    fields.add(of_error,
               [name = error->name](const LimitSummary& limit) { return find_in(limit.efficiency, name); });
  }
  Fields<Consistency> anees = {{Column::number("anees", "ANEES", 2), &Consistency::anees}};
  anees.add_range(range_columns("anees_expected_low", "anees_expected_high", 2, "ANEES expected"),
                  [](const Consistency& c) { return &c.expected; });
  fields.add(anees, &LimitSummary::consistency);
  for (Field<LimitSummary>& field : fields) field.column.fold = true;
  return fields;
}

namespace {

NoiseLevelRow summarize_level(const std::string& parameter, const NoiseLevel& level,
                              const BootstrapOptions& options) {
  NoiseLevelRow row{CurveKey::of(parameter, level.key()), level.key().noise, level.key().level};
  row.n_seeds = static_cast<int>(level.n_seeds());
  row.n_truth = static_cast<int>(level.n_truth());
  row.n_estimated = static_cast<int>(level.n_estimated());
  const ClusterBy by = level.clusters();
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    if (level.has(e)) row.errors[compared_errors()[e]->name] = summarize_sample(level.sample(e, by), options);
  }
  row.limit = summarize_limit(level, options);
  if (level.epe_initial_px().n > 0) row.epe_initial_px = level.epe_initial_px().mean();
  return row;
}

/// One statistic of SampleSummary. `detail`: it is shown in CSV and JSON only.
struct Statistic {
  IntervalEstimate SampleSummary::*member;
  const char* name;
  const char* title;
  bool detail = false;
};
constexpr std::array<Statistic, 7> statistics = {{{&SampleSummary::mean, "mean", "mean"},
                                                  {&SampleSummary::rmse, "rmse", "RMSE"},
                                                  {&SampleSummary::q05, "q05", "q05", true},
                                                  {&SampleSummary::q25, "q25", "q25", true},
                                                  {&SampleSummary::median, "median", "median"},
                                                  {&SampleSummary::q75, "q75", "q75", true},
                                                  {&SampleSummary::q95, "q95", "q95"}}};

/// Tables for readers show only the interval of the mean.
Fields<SampleSummary> statistic_fields(const MetricDefinition& error) {
  Fields<SampleSummary> fields;
  for (const Statistic& s : statistics) {
    const std::string name = s.name;
    const bool is_mean = s.member == &SampleSummary::mean;
    const Column column = Column::number(
        error.key(name), is_mean ? fmt::format("{} {} [{}]", error.symbol, s.title, error.unit) : s.title,
        error.digits + 1);
    Fields<IntervalEstimate> estimate = estimate_fields(s.detail ? column.only_in_files() : column,
                                                        error.key(name + "_low"), error.key(name + "_high"));
    for (size_t end : {1, 2}) estimate[end].column.detail = !is_mean;
    fields.add(estimate, [member = s.member](const SampleSummary& summary) { return &(summary.*member); });
  }
  return fields;
}

}  // namespace

std::vector<NoiseLevelRow> noise_levels(const NoiseSweep& sweep, int jobs, const BootstrapOptions& options) {
  std::vector<NoiseLevelRow> all(sweep.levels.size());
  parallel_for(static_cast<int>(all.size()), jobs, [&](int i) {
    const auto at = static_cast<size_t>(i);
    all[at] = summarize_level(sweep.parameter, *sweep.levels[at], options);
  });
  std::erase_if(all, [](const NoiseLevelRow& row) { return row.n_truth == 0; });
  return all;
}

Table noise_level_table(const std::vector<NoiseLevelRow>& rows) {
  using Row = NoiseLevelRow;
  Fields<Row> fields;
  fields.add(CurveKey::fields(), [](const Row& row) { return &row; });
  fields.add({{Column::number("level", 3), &Row::level},
              {Column::count("n_seeds", "seeds"), &Row::n_seeds},
              {Column::number("coverage_percent", "coverage [%]", 1),
               [](const Row& row) { return 100.0 * row.n_estimated / row.n_truth; }}});
  for (const MetricDefinition* error : compared_errors()) {
    fields.add(statistic_fields(*error),
               [name = error->name](const Row& row) { return find_in(row.errors, name); });
  }
  fields.add(Column::number("epe_initial_px", "EPE [px]", 3), &Row::epe_initial_px);
  fields.add(limit_fields(), [](const Row& row) { return &row.limit; });
  fields.add(Column::text("noise").only_in_files(), &Row::noise);
  return with_distinct(
      table_of(
          "Errors by noise level",
          "Over the estimated pairs of all seeds. Interval of the mean: bootstrap with a seed's pairs as one "
          "cluster (with one seed: frames). Objects: motion in the camera frame. Efficiency: Cramer-Rao "
          "bound (RMS) / RMSE, at most 1 except for a biased estimator or one that uses current depths; "
          "ANEES: mean normalised error squared, within its interval if the estimator's covariance is right. "
          "CSV and JSON have more quantiles and every interval.",
          fields, rows),
      {"level"});
}

namespace {

constexpr double alpha = 0.05;
constexpr double identical_below = 1e-9;  // m or deg: rounding of equal optima

/// Records of every estimator for one body at one level.
struct Level {
  const NoiseSweep* sweep = nullptr;
  std::map<Interned, const NoiseLevel*> by_estimator;
};

/// Compares one error over the pairs that both have, in clusters of frames or seeds; nullopt if there are
/// none. In summaries the mean difference of a seed stands for each of its pairs, which does not change any
/// number of a comparison; estimators are identical if mean and mean square agree up to rounding for every
/// seed.
std::optional<ErrorComparison> compare(const std::vector<NoiseLevel::Common>& pairs, bool by_frame,
                                       const BootstrapOptions& options) {
  if (pairs.empty()) return std::nullopt;
  std::vector<double> differences;
  std::vector<uint64_t> labels;
  Moments of_first;
  bool identical = true;
  for (const auto& [seed, frame, first, second] : pairs) {
    const double difference = (second.x - first.x) / first.n;
    identical = identical && std::abs(difference) <= identical_below &&
                std::abs(second.xx - first.xx) <= 2 * identical_below * (first.x + second.x);
    differences.insert(differences.end(), static_cast<size_t>(first.n), difference);
    labels.insert(labels.end(), static_cast<size_t>(first.n), by_frame ? static_cast<uint64_t>(frame) : seed);
    of_first.add(first);
  }
  ErrorComparison out{compare_pairs(differences, labels, options), of_first.mean(), identical};
  if (identical) out.p = 1;
  if (out.n_clusters < 2) out.p.reset();
  return out;
}

/// Compares two levels; nullopt if no pair was estimated by both, or if their summaries have other pairs.
std::optional<ComparisonRow> compare(const NoiseLevel& first, const NoiseLevel& second,
                                     const BootstrapOptions& options) {
  std::vector<std::vector<NoiseLevel::Common>> of_errors;
  int n_pairs = 0;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    auto common = first.common(second, e);
    if (!common) return std::nullopt;
    double n = 0;
    for (const NoiseLevel::Common& pair : *common) n += pair.first.n;
    n_pairs = std::max(n_pairs, static_cast<int>(n));
    of_errors.push_back(std::move(*common));
  }
  if (n_pairs == 0) return std::nullopt;
  const NoiseLevelKey& key = first.key();
  ComparisonRow row{.dataset = key.dataset,
                    .sequence = key.sequence,
                    .body = key.body,
                    .noise = key.noise,
                    .first = key.estimator,
                    .second = second.key().estimator,
                    .level = key.level,
                    .n_pairs = n_pairs,
                    .n_only_first = static_cast<int>(first.n_with_error()) - n_pairs,
                    .n_only_second = static_cast<int>(second.n_with_error()) - n_pairs};
  const bool by_frame = first.clusters() == ClusterBy::frames && second.clusters() == ClusterBy::frames;
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    if (auto c = compare(of_errors[e], by_frame, options))
      row.errors.emplace(compared_errors()[e]->name, std::move(*c));
  }
  return row;
}

/// Returns the estimators in order of first appearance in the records of the sweeps.
std::vector<Interned> estimators_in_order(const std::vector<NoiseSweep>& sweeps) {
  std::vector<Interned> names;
  for (const NoiseSweep& sweep : sweeps) {
    for (const Interned name : sweep.estimators) add_distinct(name, names);
  }
  return names;
}

std::vector<Level> levels_of(const std::vector<NoiseSweep>& sweeps) {
  using Key = std::tuple<size_t, std::string, std::string, int, double, std::string>;
  std::map<Key, Level> levels;
  for (size_t s = 0; s < sweeps.size(); ++s) {
    for (const NoiseLevelRef& of : sweeps[s].levels) {
      const NoiseLevelKey& key = of->key();
      Level& level = levels[{s, key.dataset, key.sequence, body_order(key.body), key.level, key.noise}];
      level.sweep = &sweeps[s];
      level.by_estimator[key.estimator] = of.get();
    }
  }
  std::vector<Level> out;
  for (auto& [key, level] : levels) out.push_back(std::move(level));
  return out;
}

std::optional<double> percent(const ErrorComparison& comparison) {
  if (!(comparison.mean_first > 0)) return std::nullopt;
  return 100 * comparison.difference / comparison.mean_first;
}

void add_fields(const MetricDefinition& error, Fields<ComparisonRow>& fields) {
  const std::string stem = error.stem();
  const int decimals = error.digits + 1;
  Fields<ErrorComparison> of_error = {
      {Column::number(error.key("difference"), fmt::format("\u0394 {}", error.heading()), decimals),
       &ErrorComparison::difference}};
  of_error.add_range(range_columns(error.key("low"), error.key("high"), decimals),
                     &ErrorComparison::interval);
  of_error.add(
      {{Column::number(stem + "_difference_percent", "[%]", 1), percent},
       {Column::p_value(stem + "_p").only_in_files(), &ErrorComparison::p},
       {Column::p_value(stem + "_p_corrected"), &ErrorComparison::p_corrected},
       {Column::number(error.key("detectable"), "detectable", decimals), &ErrorComparison::detectable}});
  const auto find = [name = error.name](const ComparisonRow& row) { return find_in(row.errors, name); };
  fields.add(of_error, find);
  fields.add(Column::text(stem + "_verdict", "verdict"), [find](const ComparisonRow& row) {
    const ErrorComparison* comparison = find(row);
    return comparison != nullptr ? Cell(verdict(*comparison, row)) : Cell();
  });
}

}  // namespace

std::vector<ComparisonRow> compare_estimators(const std::vector<NoiseSweep>& sweeps, int jobs,
                                              const BootstrapOptions& options, size_t* n_left_out) {
  const std::vector<Interned> names = estimators_in_order(sweeps);
  const std::vector<Level> levels = levels_of(sweeps);
  std::vector<std::vector<ComparisonRow>> of_level(levels.size());
  std::vector<size_t> left_out(levels.size());
  parallel_for(static_cast<int>(levels.size()), jobs, [&](int i) {
    const Level& level = levels[static_cast<size_t>(i)];
    for (size_t a = 0; a < names.size(); ++a) {
      for (size_t b = a + 1; b < names.size(); ++b) {
        const auto first = level.by_estimator.find(names[a]);
        const auto second = level.by_estimator.find(names[b]);
        if (first == level.by_estimator.end() || second == level.by_estimator.end()) continue;
        const NoiseLevel& one = *first->second;
        const NoiseLevel& other = *second->second;
        std::optional<ComparisonRow> row = compare(one, other, options);
        const bool is_summed = one.is_summed() || other.is_summed();
        if (!row && is_summed && one.n_with_error() > 0 && other.n_with_error() > 0)
          ++left_out[static_cast<size_t>(i)];
        if (!row) continue;
        row->parameter = level.sweep->parameter;
        of_level[static_cast<size_t>(i)].push_back(std::move(*row));
      }
    }
  });
  std::vector<ComparisonRow> rows;
  for (std::vector<ComparisonRow>& more : of_level) {
    std::move(more.begin(), more.end(), std::back_inserter(rows));
  }
  std::vector<ErrorComparison*> family;
  for (ComparisonRow& row : rows) {
    for (auto& [name, comparison] : row.errors) {
      comparison.p_corrected = comparison.p;
      if (!comparison.identical) family.push_back(&comparison);  // nothing is tested where nothing differs
    }
  }
  correct_by_holm(family);
  const auto n_tests = std::ranges::count_if(family, [](const auto* test) { return test->p.has_value(); });
  for (ErrorComparison* test : family)  // all clusters differ in the same direction
    test->smallest_p = static_cast<double>(n_tests) * std::ldexp(1.0, 1 - test->n_clusters);
  if (n_left_out != nullptr) *n_left_out = std::accumulate(left_out.begin(), left_out.end(), size_t{0});
  return rows;
}

std::string verdict(const ErrorComparison& comparison, const ComparisonRow& row) {
  if (comparison.identical) return "identical";
  const std::optional<Interval>& interval = comparison.interval;
  if (!comparison.p_corrected || !interval) return "too few clusters";
  if (interval->low <= 0 && interval->high >= 0) return "no difference seen";
  if (*comparison.p_corrected > alpha)
    return comparison.smallest_p > alpha ? "too few clusters" : "no difference seen";
  return (comparison.difference < 0 ? row.second : row.first) + " lower";
}

Table comparison_table(const std::vector<ComparisonRow>& rows) {
  using Row = ComparisonRow;
  Fields<Row> fields = {{Column::text("parameter").folded(), &Row::parameter},
                        {Column::text("dataset").folded(), &Row::dataset},
                        {Column::text("sequence").folded(), &Row::sequence},
                        {Column::text("first").folded(), &Row::first},
                        {Column::text("second").folded(), &Row::second},
                        {Column::text("body"), &Row::body},
                        {Column::number("level", 3), &Row::level},
                        {Column::count("n_pairs", "pairs"), &Row::n_pairs},
                        {Column::count("n_only_first", "only first").folded(), &Row::n_only_first},
                        {Column::count("n_only_second", "only second").folded(), &Row::n_only_second}};
  for (const MetricDefinition* error : compared_errors()) add_fields(*error, fields);
  fields.add(Column::text("noise").only_in_files(), &Row::noise);
  return with_distinct(
      table_of(
          "Estimators compared pair by pair",
          "Difference of the mean errors, second - first, over the pairs that both have estimated. Clusters "
          "of the intervals: seeds; with one seed frames. p: Wilcoxon's signed ranks on the clusters' means, "
          "corrected by Holm over the whole table. detectable: found at 5 % with probability 80 %. Too few "
          "clusters: the interval excludes 0, but so many comparisons of so few seeds cannot reach 5 %.",
          fields, rows),
      {"level"});
}

namespace {

/// Returns the number at a JSON pointer such as "/depth/n", if there is one.
std::optional<double> number_at(const Json& json, const char* path) {
  const Json::json_pointer pointer(path);
  if (!json.contains(pointer) || !json.at(pointer).is_number()) return std::nullopt;
  return json.at(pointer).get<double>();
}

void add_depth(const AchievedNoise& entry, AchievedNoiseRow row, std::vector<AchievedNoiseRow>& rows) {
  const auto requested = number_at(entry.noise, "/requested/depth/delta_d_px");
  const auto achieved = number_at(entry.noise, "/depth/normalised_sigma");
  row.share_invalidated = number_at(entry.noise, "/depth/share_invalidated");
  if ((!requested || !achieved) && !row.share_invalidated) return;
  row.channel = "depth";
  if (requested && achieved) {
    row.requested_px = *requested;
    row.achieved_px = *achieved * *requested;
  }
  row.n = number_at(entry.noise, "/depth/n").value_or(0);
  row.neighbours = number_at(entry.noise, "/neighbours/depth/correlation");
  rows.push_back(row);
}

void add_flow(const AchievedNoise& entry, const std::string& body, const Json& flow, AchievedNoiseRow row,
              std::vector<AchievedNoiseRow>& rows) {
  row.body = body;
  row.n = number_at(flow, "/n").value_or(0);
  row.outlier_share = number_at(flow, "/outlier_share");
  const size_t n_before = rows.size();
  const auto add = [&](const char* channel, std::optional<double> requested, std::optional<double> achieved) {
    if (!requested || !achieved) return;
    row.channel = channel;
    row.requested_px = *requested;
    row.achieved_px = *achieved;
    rows.push_back(row);
  };
  add("flow EPE", number_at(flow, "/requested_epe_px"), number_at(flow, "/epe_px"));
  add("flow y", number_at(flow, "/y/requested_sigma_px"), number_at(flow, "/y/sigma_px"));
  row.neighbours = number_at(entry.noise, "/neighbours/flow_x/correlation");
  add("flow x", number_at(flow, "/x/requested_sigma_px"), number_at(flow, "/x/sigma_px"));
  if (rows.size() > n_before || row.outlier_share.value_or(0) == 0) return;
  // Every flow is an outlier, so none shows the noise.
  row.channel = "flow";
  row.requested_px.reset();
  row.achieved_px.reset();
  rows.push_back(row);
}

}  // namespace

std::vector<AchievedNoiseRow> achieved_noise_rows(const NoiseSweep& sweep) {
  std::vector<AchievedNoiseRow> rows;
  for (const AchievedNoise& entry : sweep.achieved) {
    AchievedNoiseRow row{.parameter = sweep.parameter,
                         .source = entry.source,
                         .body = "all",
                         .file = entry.file,
                         .level = entry.level};
    add_depth(entry, row, rows);
    if (!entry.noise.contains("flow") || !entry.noise["flow"].is_object()) continue;
    for (const auto& [body, flow] : entry.noise["flow"].items()) add_flow(entry, body, flow, row, rows);
  }
  return rows;
}

Table achieved_noise_table(const std::vector<AchievedNoiseRow>& rows) {
  using Row = AchievedNoiseRow;
  const bool has_folders =
      std::ranges::any_of(rows, [&](const Row& row) { return row.file != rows.front().file; });
  Fields<Row> fields = {{Column::text("parameter").folded(), &Row::parameter},
                        {Column::text("source").folded(), &Row::source},
                        {Column::number("level", 3), &Row::level},
                        {Column::text("body").folded(), &Row::body},
                        {Column::text("channel"), &Row::channel},
                        {Column::number("requested_px", "requested [px]", 4), &Row::requested_px},
                        {Column::number("achieved_px", "achieved [px]", 4), &Row::achieved_px},
                        {Column::number("ratio", 4),
                         [](const Row& row) {
                           const bool has_ratio = row.requested_px.value_or(0) > 0 && row.achieved_px;
                           return has_ratio ? Cell(*row.achieved_px / *row.requested_px) : Cell();
                         }},
                        {Column::count("n", "draws"), &Row::n},
                        {Column::number("neighbours", 4), &Row::neighbours},
                        {Column::number("share_invalidated", "invalidated", 6), &Row::share_invalidated},
                        {Column::number("outlier_share", "outliers", 4), &Row::outlier_share}};
  if (has_folders) {  // such as shards, each of which added noise to other cases of one level
    fields.insert(fields.begin(), {Column::text("folder"),
                                   [](const Row& row) { return Cell(row.file.parent_path().string()); }});
  }
  return with_distinct(
      table_of(
          "Noise: requested and achieved",
          "Depth: disparity accuracy. Flow x, y: standard deviation; EPE: mean length of the error vector. "
          "neighbours: correlation of the random draws of neighbouring pixels. Achieved depths include the "
          "rounding of a quantisation, which is not part of the request.",
          fields, rows),
      {"level"});
}

}  // namespace sextant
