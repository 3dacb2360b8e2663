#include "sextant/eval/report/tables/published_rows.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sextant/base/text.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/clustered_sample.h"
#include "sextant/stats/summary.h"
#include "sextant/stats/tests.h"

namespace sextant {

namespace {

/// Range of single runs, m +- t s sqrt(1 + 1/n). Sizes, which are never negative, are at least 0.
std::optional<Interval> one_run_range(const std::vector<double>& by_seed) {
  const auto n = static_cast<double>(by_seed.size());
  if (by_seed.size() < 2) return std::nullopt;
  const double half = student_t_quantile(0.975, static_cast<int>(by_seed.size()) - 1) * std_dev(by_seed) *
                      std::sqrt(1 + 1 / n);
  const bool is_size = std::ranges::none_of(by_seed, [](double value) { return value < 0; });
  return Interval{is_size ? std::max(mean(by_seed) - half, 0.0) : mean(by_seed) - half, mean(by_seed) + half};
}

}  // namespace

std::optional<Measured> measure_mean(const std::vector<RecordNumber>& numbers, const Clusters& clusters) {
  if (numbers.empty()) return std::nullopt;
  std::vector<double> values;
  std::vector<uint64_t> labels;
  for (const auto& [record, value] : numbers) {
    values.push_back(value);
    labels.push_back(clusters.of(*record));
  }
  const ClusteredSample sample(values, labels);
  Measured measured;
  measured.value = mean(values);
  measured.interval =
      cluster_bootstrap(sample.n_clusters(), [&](std::span<const size_t> c) { return sample.mean(c); });
  measured.n_pairs = static_cast<int>(values.size());
  measured.n_seeds = clusters.n_seeds();
  if (!clusters.are_frames()) {
    std::vector<double> by_seed;
    for (const ClusterSum& seed : cluster_sums(values, labels)) by_seed.push_back(seed.of.mean());
    measured.one_run = one_run_range(by_seed);
  }
  return measured;
}

std::optional<Measured> measure_mean(const RecordRefs& records, NumberMap map, const std::string& key) {
  std::vector<RecordNumber> numbers;
  for (const Record* record : records) {
    if (const auto value = find_number(record->numbers(map), key)) numbers.push_back({record, *value});
  }
  return measure_mean(numbers, Clusters(records));
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

Measured Measured::scaled(double factor) const {
  Measured out = *this;
  out.value *= factor;
  for (std::optional<Interval>* range : {&out.interval, &out.one_run}) {
    if (*range) *range = Interval{(*range)->low * factor, (*range)->high * factor};
  }
  return out;
}

std::string verdict_on(const std::optional<double>& published, const std::optional<Measured>& measured) {
  if (!measured) return "not measured here";
  if (!published) return "";
  const std::optional<Interval>& range = measured->one_run ? measured->one_run : measured->interval;
  if (!range) return "undecided";
  return *published >= range->low && *published <= range->high ? "within" : "outside";
}

const Json& layout_data() {
  static const Json data = published_json("zhang2020_layout.json");
  return data;
}

bool is_of_kind(const std::string& dataset, const Json& kind) {
  return std::ranges::count(kind.at("datasets"), Json(dataset)) > 0;
}

std::string reason_of(const Json& layout_row, const std::string& dataset) {
  const Json reasons = layout_row.value("not_comparable", Json::object());
  for (const Json& kind : layout_data().at("data")) {
    const std::string name = kind.at("name");
    if (is_of_kind(dataset, kind) && reasons.contains(name)) return reasons.at(name);
  }
  return reasons.value("*", "");
}

PublishedTable with_reasons(PublishedTable table) {
  for (const Json& layout : layout_data().at("tables")) {
    if (layout.at("number") != table.number) continue;
    for (const Json& entry : layout.at("rows")) {
      const Json quantities = entry.value("quantities", Json::array());
      for (PaperRow& row : table.rows) {
        if (std::ranges::count(quantities, Json(row.quantity)) == 0) continue;
        row.reason = entry.contains("rate_of")
                         ? fmt::format("the totals differ; the table as printed compares the share of {}",
                                       entry.at("rate_of").get<std::string>())
                         : reason_of(entry, row.dataset);
      }
    }
  }
  return table;
}

Table PublishedTable::table() const {
  using Row = PaperRow;
  Fields<Row> fields = labels;
  fields.add(Column::text("quantity"), &Row::quantity);
  fields.add(Column::number("published", decimals), &Row::published);
  Fields<Measured> of_measured = {
      {Column::number("reproduced", decimals).leading_to("records"), &Measured::value}};
  of_measured.add_range(range_columns("low", "high", decimals), &Measured::interval);
  of_measured.add_range(range_columns("run_low", "run_high", decimals, "single runs"), &Measured::one_run);
  fields.add(of_measured, &Row::measured);
  fields.add(Column::number("difference", decimals), [](const Row& row) {
    return row.measured && row.published ? Cell(row.measured->value - *row.published) : Cell();
  });
  fields.add(Column::text("verdict"), &Row::verdict);
  fields.add(Fields<Measured>{{Column::count("pairs"), &Measured::n_pairs},
                              {Column::count("seeds"), &Measured::n_seeds}},
             &Row::measured);
  fields.add(Column::text("data").folded(), [](const Row& row) {
    if (!row.is_missing() || row.command.empty())
      return row.data.empty() && !row.measured ? "none" : row.data;
    return (row.data.empty() ? "" : row.data + "; ") + "measured by: " + row.command;
  });
  fields.add(Column::text("records").only_in_files(),
             [](const Row& row) { return records_of_part(row.records); });
  for (const Column& column : more) {
    fields.add(column, [key = column.key](const Row& row) {
      const auto cell = row.more.find(key);
      return cell == row.more.end() ? Cell() : Cell(cell->second);
    });
  }
  const TableText text = paper().table(number);
  Table made = table_of(
      text.title,
      text.caption +
          " 95 % interval: of the mean (bootstrap over seeds; with one seed over stretches of 5 frames). "
          "Single runs: range of 95 % of them. Verdict: within if the published value, which is one run, "
          "lies in this range (with one seed: in the interval).",
      fields, rows);
  for (const Row& row : rows) {
    if (row.verdict() == "not comparable")
      add_distinct(fmt::format("{}: not comparable: {}.", row.quantity, row.reason), made.notes);
  }
  return made;
}

std::string records_of_part(const std::string& part) {
  return part.empty() ? "" : fmt::format("parts/{}/records.jsonl", part);
}

RecordRefs matching(const std::vector<Record>& records, const RecordFilter& filter) {
  return records_where(records, [&](const Record& record) { return filter.matches(record); });
}

std::string paper_body(const std::string& printed) { return printed == "Obj" ? "Obj1" : printed; }

std::map<std::string, RecordRefs> paper_bodies(const RecordRefs& records) {
  std::map<std::string, RecordRefs> bodies;
  std::map<std::pair<double, int>, RecordRefs> objects;  // by mean distance and id
  for (const auto& [id, with_truth] : group_by(records_where(records, has_truth), order_of)) {
    const RecordRefs estimated = records_where(with_truth, is_evaluated);
    if (id != 0)
      objects[{mean(numbers_of(with_truth, NumberMap::values, "distance_gt_m")), id}] = estimated;
    else if (!estimated.empty())
      bodies["Ego"] = estimated;
  }
  for (size_t i = 0; const auto& [place, estimated] : objects) bodies[fmt::format("Obj{}", ++i)] = estimated;
  return bodies;
}

}  // namespace sextant
