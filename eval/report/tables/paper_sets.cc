#include "sextant/eval/report/tables/paper_sets.h"

#include <algorithm>

#include "sextant/eval/report/record_reading.h"
#include "sextant/stats/summary.h"

namespace sextant {
const std::vector<SetData>& set_data() {
  static const std::vector<SetData> data = {
      {"S01-F225-235", {"vkitti1", "0001/clone", 225, 235}},
      {"S01-F225-235", {"vkitti2", "Scene01/clone", 225, 235}},
      {"S01-F225-235", {"replay-vkitti1", "0001/clone", 225, 235}},
      {"S01-F225-235", {"synthetic", "s01-turn"}},
      {"S01-F410-418", {"vkitti1", "0001/clone", 410, 418}},
      {"S01-F410-418", {"vkitti2", "Scene01/clone", 410, 418}},
      {"S01-F410-418", {"replay-vkitti1", "0001/clone", 410, 418}},
      {"S01-F410-418", {"synthetic", "s01-crossing"}},
      {"S18-F124-134", {"vkitti1", "0018/clone", 124, 134}},
      {"S18-F124-134", {"vkitti2", "Scene18/clone", 124, 134}},
      {"S18-F124-134", {"replay-vkitti1", "0018/clone", 124, 134}},
      {"S18-F124-134", {"synthetic", "s18"}},
  };
  return data;
}

std::string set_data_title(const RecordFilter& filter) {
  const std::string title = data_title(filter.dataset, filter.sequence);
  if (filter.last_frame == RecordFilter{}.last_frame) return title;
  return fmt::format("{}, frames {}-{}", title, filter.first_frame, filter.last_frame);
}

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
