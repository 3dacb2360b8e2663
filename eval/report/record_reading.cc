#include "sextant/eval/report/record_reading.h"

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

}  // namespace sextant
