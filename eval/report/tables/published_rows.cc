#include "sextant/eval/report/tables/published_rows.h"

#include <cmath>
#include <map>

#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/clustered_sample.h"
#include "sextant/stats/distributions.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr int frames_per_stretch = 5;

/// m +- t s sqrt(1 + 1/n).
std::optional<Interval> one_run_range(const std::vector<double>& by_seed) {
  const auto n = static_cast<double>(by_seed.size());
  if (by_seed.size() < 2) return std::nullopt;
  const double half = student_t_quantile(0.975, static_cast<int>(by_seed.size()) - 1) * std_dev(by_seed) *
                      std::sqrt(1 + 1 / n);
  return Interval{mean(by_seed) - half, mean(by_seed) + half};
}

}  // namespace

std::optional<Measured> measure_mean(const RecordRefs& records, NumberMap map, const std::string& key) {
  const Clusters clusters(records);
  std::vector<double> values;
  std::vector<uint64_t> labels;
  std::map<uint64_t, std::pair<double, double>> sums;  // by cluster: sum, count
  std::map<std::string, uint64_t> sequences;
  for (const Record* record : records) {
    const auto value = find_number(record->numbers(map), key);
    if (!value) continue;
    const uint64_t sequence = sequences.try_emplace(record->sequence, sequences.size()).first->second;
    const uint64_t label = clusters.are_frames()
                               ? (sequence << 32) + static_cast<uint64_t>(record->frame / frames_per_stretch)
                               : clusters.of(*record);
    values.push_back(*value);
    labels.push_back(label);
    sums[label].first += *value;
    sums[label].second += 1;
  }
  if (values.empty()) return std::nullopt;
  const ClusteredSample sample(values, labels);
  Measured measured;
  measured.value = mean(values);
  measured.interval =
      cluster_bootstrap(sample.n_clusters(), [&](std::span<const size_t> c) { return sample.mean(c); });
  measured.n_pairs = static_cast<int>(values.size());
  measured.n_seeds = clusters.n_seeds();
  if (!clusters.are_frames()) {
    std::vector<double> by_seed;
    for (const auto& [label, sum] : sums) by_seed.push_back(sum.first / sum.second);
    measured.one_run = one_run_range(by_seed);
  }
  return measured;
}

Measured measure_by_seed(const std::vector<double>& by_seed, int n_pairs) {
  Measured measured;
  measured.value = mean(by_seed);
  measured.interval = bootstrap(by_seed, [](std::span<const double> values) { return mean(values); });
  measured.one_run = one_run_range(by_seed);
  measured.n_pairs = n_pairs;
  measured.n_seeds = static_cast<int>(by_seed.size());
  return measured;
}

std::string published_verdict(const std::optional<double>& published,
                              const std::optional<Measured>& measured) {
  if (!measured) return "not measured here";
  if (!published) return "";
  const std::optional<Interval>& range = measured->one_run ? measured->one_run : measured->interval;
  if (!range) return "undecided";
  return *published >= range->low && *published <= range->high ? "within" : "outside";
}

Table published_table(const std::string& title, const std::string& caption, std::vector<Column> labels,
                      int decimals) {
  Table table{title, caption + " " + comparison_caption, std::move(labels)};
  const auto number = [&](const char* key, const char* name) {
    table.columns.push_back(Column::number(key, name, decimals));
  };
  table.columns.push_back(Column::text("quantity"));
  number("published", "published");
  number("reproduced", "reproduced");
  table.columns.back().leads_to = "records";
  table.add_columns(range_columns("low", "high", decimals));
  number("run_low", "run low");
  table.columns.back().range = "single runs";
  number("run_high", "run high");
  number("difference", "difference");
  table.columns.push_back(Column::text("verdict"));
  table.columns.push_back(Column::count("pairs"));
  table.columns.push_back(Column::count("seeds"));
  table.columns.push_back(Column::text("data").folded());
  table.columns.push_back(Column::text("records").only_in_files());
  return table;
}

std::vector<Cell> published_cells(const PaperRow& row) {
  std::vector<Cell> cells(row.labels.begin(), row.labels.end());
  const std::optional<Measured>& m = row.measured;
  cells.emplace_back(row.quantity);
  cells.push_back(row.published);
  add_estimate(m, cells);
  add_interval(m ? m->one_run : std::nullopt, cells);
  cells.push_back(m && row.published ? std::optional(m->value - *row.published) : std::nullopt);
  cells.emplace_back(published_verdict(row.published, m));
  cells.push_back(m ? std::optional<double>(m->n_pairs) : std::nullopt);
  cells.push_back(m ? std::optional<double>(m->n_seeds) : std::nullopt);
  cells.emplace_back(row.data.empty() && !m ? "none" : row.data);
  cells.emplace_back(records_of_part(row.records));
  return cells;
}

std::string records_of_part(const std::string& part) {
  return part.empty() ? "" : fmt::format("parts/{}/records.jsonl", part);
}

void add_published_row(const PaperRow& row, Table& table) { table.add_row(published_cells(row)); }

}  // namespace sextant
