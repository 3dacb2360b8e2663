#include "sextant/eval/report/figures/record_sets.h"

#include <algorithm>
#include <map>

#include "sextant/eval/report/record_reading.h"

namespace sextant {

std::vector<RecordSet> record_sets(const std::vector<Record>& records) {
  std::map<std::pair<std::string, std::string>, std::map<int, BodyRecords>> sets;
  for (const Record& record : records) {
    if (!has_truth(record) || record.status != Status::ok) continue;
    BodyRecords& body = sets[{record.dataset, record.sequence}][body_order(record.body)];
    body.title = body_title(record.body);
    body.records.push_back(&record);
  }
  std::vector<RecordSet> out;
  for (auto& [key, bodies] : sets) {
    RecordSet set{key.first + "_" + key.second, key.first + " " + key.second, {}};
    for (auto& [order, body] : bodies) set.bodies.push_back(std::move(body));
    out.push_back(std::move(set));
  }
  return out;
}

std::vector<std::string> estimators_of(const RecordSet& set) {
  std::vector<std::string> names;
  for (const BodyRecords& body : set.bodies) {
    for (const Record* record : body.records) {
      const std::string& name = record->estimator;
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

std::vector<const Record*> of_estimator(const std::vector<const Record*>& records,
                                        const std::string& estimator) {
  std::vector<const Record*> out;
  std::ranges::copy_if(records, std::back_inserter(out),
                       [&](const Record* record) { return record->estimator == estimator; });
  return out;
}

}  // namespace sextant
