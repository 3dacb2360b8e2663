#include "sextant/eval/report/tables/paper_sets.h"

#include <algorithm>

#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/summary.h"

namespace sextant {

std::vector<PaperBody> bodies_by_distance(const RecordRefs& records) {
  std::map<int, RecordRefs> by_id;
  for (const Record* record : records) {
    if (has_truth(*record)) by_id[body_order(record->body)].push_back(record);
  }
  std::vector<std::pair<double, int>> by_distance;
  for (const auto& [id, of_body] : by_id) {
    if (id != 0) by_distance.emplace_back(mean(numbers_of(of_body, NumberMap::values, "distance_gt_m")), id);
  }
  std::ranges::sort(by_distance);
  std::vector<PaperBody> bodies;
  if (by_id.contains(0)) bodies.push_back({0, 0, by_id.at(0)});
  for (const auto& [distance_m, id] : by_distance) {
    const size_t number = bodies.empty() ? 1 : bodies.back().number + 1;
    bodies.push_back({number, id, by_id.at(id)});
  }
  return bodies;
}

RecordRefs matching(const std::vector<Record>& records, const RecordFilter& filter) {
  RecordRefs found;
  for (const Record& record : records) {
    if (filter.matches(record)) found.push_back(&record);
  }
  return found;
}

std::map<std::string, RecordRefs> by_estimator(const RecordRefs& records) {
  std::map<std::string, RecordRefs> groups;
  for (const Record* record : records) groups[record->estimator].push_back(record);
  return groups;
}

std::string paper_body(const std::string& printed) { return printed == "Obj" ? "Obj1" : printed; }

std::map<std::string, RecordRefs> paper_bodies(const RecordRefs& records) {
  std::map<std::string, RecordRefs> bodies;
  for (PaperBody& body : bodies_by_distance(records)) {
    std::erase_if(body.records, [](const Record* record) { return record->status != Status::ok; });
    if (body.number > 0 || !body.records.empty())
      bodies[body.number == 0 ? "Ego" : fmt::format("Obj{}", body.number)] = std::move(body.records);
  }
  return bodies;
}

}  // namespace sextant
