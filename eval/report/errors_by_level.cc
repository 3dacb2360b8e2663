#include "sextant/eval/report/errors_by_level.h"

#include <algorithm>
#include <array>

#include "sextant/base/machine.h"
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
  anees.add_range(range_columns("anees_expected_low", "anees_expected_high", 2, "expected"),
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
  for (size_t e = 0; e < compared_errors().size(); ++e) {
    if (level.has(e))
      row.errors[compared_errors()[e]->name] = summarize_sample(level.sample(e, level.clusters()), options);
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

}  // namespace sextant
