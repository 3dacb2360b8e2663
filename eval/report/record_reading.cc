#include "sextant/eval/report/record_reading.h"

#include <set>

namespace sextant {

std::optional<double> find_number(const Record::Numbers& numbers, const std::string& key) {
  const auto it = numbers.find(key);
  return it == numbers.end() ? std::nullopt : std::optional<double>(it->second);
}

bool has_truth(const Record& record) {
  if (record.is_ego()) return record.values.contains("step_gt_m");
  return record.values.contains("distance_gt_m") && find_number(record.values, "dynamic_gt").value_or(1) != 0;
}

int body_order(const Record& record) {
  return record.is_ego() ? 0 : std::stoi(record.body.substr(record.body.find(':') + 1));
}

std::string body_title(const std::string& body) {
  constexpr std::string_view object = "object:";
  return body == "ego" ? "camera" : "object " + body.substr(object.size());
}

Clusters::Clusters(const std::vector<const Record*>& records) {
  std::set<uint64_t> seeds;
  for (const Record* record : records) seeds.insert(record->seed);
  n_seeds_ = static_cast<int>(seeds.size());
}

uint64_t Clusters::of(const Record& record) const {
  return are_frames() ? static_cast<uint64_t>(record.frame) : record.seed;
}

ErrorSample error_sample(const std::vector<const Record*>& records, const std::string& key,
                         const Clusters& clusters) {
  ErrorSample sample;
  for (const Record* record : records) {
    if (const auto value = find_number(record->errors, key)) {
      sample.values.push_back(*value);
      sample.clusters.push_back(clusters.of(*record));
    }
  }
  return sample;
}

void add_interval(const std::optional<Interval>& interval, std::vector<Cell>& cells) {
  cells.push_back(cell(interval ? std::optional(interval->low) : std::nullopt));
  cells.push_back(cell(interval ? std::optional(interval->high) : std::nullopt));
}

}  // namespace sextant
