#include "sextant/eval/report/record_reading.h"

#include <set>

namespace sextant {

std::vector<double> numbers_of(const RecordRefs& records, NumberMap map, const std::string& key) {
  std::vector<double> numbers;
  for (const Record* record : records) {
    if (const auto number = find_number(record->numbers(map), key)) numbers.push_back(*number);
  }
  return numbers;
}

std::map<SeedFrame, double> errors_by_case(const RecordRefs& records, const std::string& key) {
  std::map<SeedFrame, double> errors;
  for (const Record* record : records) {
    if (const auto error = find_number(record->errors, key)) errors[{record->seed, record->frame}] = *error;
  }
  return errors;
}

bool has_compared_error(const Record& record) {
  return std::ranges::any_of(metrics_for(compared),
                             [&](const MetricDefinition* m) { return record.errors.contains(m->name); });
}

std::string body_title(const std::string& body) {
  constexpr std::string_view object = "object:";
  return body == "ego" ? "camera" : "object " + body.substr(object.size());
}

Clusters::Clusters(const RecordRefs& records) {
  std::set<uint64_t> seeds;
  for (const Record* record : records) seeds.insert(record->seed);
  n_seeds_ = static_cast<int>(seeds.size());
}

uint64_t Clusters::of(const Record& record) const {
  return are_frames() ? static_cast<uint64_t>(record.frame) : record.seed;
}

ErrorSample error_sample(const RecordRefs& records, const std::string& key, const Clusters& clusters) {
  ErrorSample sample;
  for (const Record* record : records) {
    if (const auto value = find_number(record->errors, key)) {
      sample.values.push_back(*value);
      sample.clusters.push_back(clusters.of(*record));
    }
  }
  return sample;
}

Column metric_column(const MetricDefinition& metric) {
  return {.key = metric.name, .title = metric.heading(), .decimals = metric.digits};
}

void add_interval(const std::optional<Interval>& interval, std::vector<Cell>& cells) {
  cells.push_back(interval ? std::optional(interval->low) : std::nullopt);
  cells.push_back(interval ? std::optional(interval->high) : std::nullopt);
}

void add_estimate(const std::optional<IntervalEstimate>& estimate, std::vector<Cell>& cells) {
  cells.push_back(estimate ? std::optional(estimate->value) : std::nullopt);
  add_interval(estimate ? estimate->interval : std::nullopt, cells);
}

}  // namespace sextant
