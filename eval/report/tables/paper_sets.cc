#include "sextant/eval/report/tables/paper_sets.h"

#include <algorithm>

#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

double mean_distance_m(const RecordRefs& records) {
  double sum = 0;
  for (const Record* record : records) sum += record->values.at("distance_gt_m");
  return sum / static_cast<double>(records.size());
}

}  // namespace

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

std::map<std::string, RecordRefs> paper_bodies(const std::vector<Record>& records,
                                               const RecordFilter& filter) {
  std::map<int, RecordRefs> with_truth;
  std::map<int, RecordRefs> estimated;
  for (const Record& record : records) {
    if (!filter.matches(record) || !has_truth(record)) continue;
    with_truth[body_order(record)].push_back(&record);
    if (record.status == Status::ok) estimated[body_order(record)].push_back(&record);
  }
  std::vector<std::pair<double, int>> by_distance;
  for (const auto& [id, of_body] : with_truth) {
    if (id != 0) by_distance.emplace_back(mean_distance_m(of_body), id);
  }
  std::sort(by_distance.begin(), by_distance.end());
  std::map<std::string, RecordRefs> bodies;
  if (estimated.contains(0)) bodies["Ego"] = estimated[0];
  for (size_t i = 0; i < by_distance.size(); ++i) {
    bodies[fmt::format("Obj{}", i + 1)] = estimated[by_distance[i].second];
  }
  return bodies;
}

}  // namespace sextant
