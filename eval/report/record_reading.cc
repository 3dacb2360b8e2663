#include "sextant/eval/report/record_reading.h"

#include <algorithm>
#include <map>
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
    for (const Record* record : body.records) add_distinct(record->estimator, names);
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
