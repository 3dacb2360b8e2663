#pragma once

// Access to records that all tables share.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sextant/base/text.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

using RecordRefs = std::vector<const Record*>;

// ---- Cases of records in columns: a row is one seed and frame, for one estimator and body. Noise levels
// (noise_level.h) and the subjects of a comparison (eval/gate/subject_cases.h) add their numbers as
// further columns.

/// A seed of the noise and a frame; estimators are paired by it.
using SeedFrame = std::pair<uint64_t, int>;

struct CaseColumns {
  std::vector<uint64_t> seeds;
  std::vector<int> frames;

  size_t size() const { return seeds.size(); }
  SeedFrame case_of(size_t row) const { return {seeds[row], frames[row]}; }
  void add(uint64_t seed, int frame) {
    seeds.push_back(seed);
    frames.push_back(frame);
  }
  /// Returns the order of the rows by case; rows of the same case keep their order. nullopt if the rows are
  /// already in order.
  std::optional<std::vector<size_t>> sorting_order() const {
    std::vector<size_t> order(size());
    std::iota(order.begin(), order.end(), size_t{0});
    const auto case_at = [&](size_t row) { return case_of(row); };
    if (std::ranges::is_sorted(order, {}, case_at)) return std::nullopt;
    std::ranges::stable_sort(order, {}, case_at);
    return order;
  }
};

/// Puts a column into another order.
template <typename T>
void reorder(const std::vector<size_t>& order, std::vector<T>& values) {
  std::vector<T> ordered;
  ordered.reserve(values.size());
  for (const size_t i : order) ordered.push_back(values[i]);
  values = std::move(ordered);
}

/// Calls visit(row of first, row of second) for each case of two sorted tables, in order; a row is nullopt if
/// its table does not have the case.
template <typename Visit>
void for_each_case(const CaseColumns& first, const CaseColumns& second, const Visit& visit) {
  for (size_t a = 0, b = 0; a < first.size() || b < second.size();) {
    const bool only_first = b == second.size(), only_second = a == first.size();
    const bool in_first = only_first || (!only_second && first.case_of(a) <= second.case_of(b));
    const bool in_second = only_second || (!only_first && second.case_of(b) <= first.case_of(a));
    visit(in_first ? std::optional(a) : std::nullopt, in_second ? std::optional(b) : std::nullopt);
    a += in_first;
    b += in_second;
  }
}

// ---- Records by their properties. `records` contains records or pointers to records, to which the results
// point.

inline const Record& as_record(const Record& record) { return record; }
inline const Record& as_record(const Record* record) { return *record; }

/// Returns the records for which `is_chosen(record)` is true, in order.
template <typename Records, typename IsChosen>
RecordRefs records_where(const Records& records, const IsChosen& is_chosen) {
  RecordRefs chosen;
  for (const auto& item : records) {
    if (is_chosen(as_record(item))) chosen.push_back(&as_record(item));
  }
  return chosen;
}

/// Groups records by a member or a function of the record, in order of its values. The records of a group
/// keep their order.
template <typename Records, typename KeyOf>
auto group_by(const Records& records, const KeyOf& key_of) {
  std::map<std::decay_t<std::invoke_result_t<KeyOf, const Record&>>, RecordRefs> groups;
  for (const auto& item : records) groups[std::invoke(key_of, as_record(item))].push_back(&as_record(item));
  return groups;
}

/// Returns true for a record that has truth and was estimated.
inline bool is_evaluated(const Record& record) { return has_truth(record) && record.status == Status::ok; }
/// Returns body_order() of its body.
inline int order_of(const Record& record) { return body_order(record.body); }

// ---- Numbers of records.

/// Returns the keys that all of these maps have, in order: the cases in which they can be compared.
template <typename Map>
std::vector<typename Map::key_type> common_keys(const std::vector<const Map*>& maps) {
  std::vector<typename Map::key_type> keys;
  for (const auto& [key, value] : *maps.front()) {
    if (std::ranges::all_of(maps, [&key = key](const Map* map) { return map->contains(key); }))
      keys.push_back(key);
  }
  return keys;
}

/// Returns the values of one member, each once, in order of first appearance.
template <typename Item, typename Member>
std::vector<std::string> distinct(const std::vector<const Item*>& items, Member member) {
  std::vector<std::string> values;
  for (const Item* item : items) add_distinct(item->*member, values);
  return values;
}

/// Returns the number called `key`; empty if the record does not have it.
template <typename Map>
std::optional<double> find_number(const Map& numbers, const typename Map::key_type& key) {
  const double* number = find_in(numbers, key);
  return number == nullptr ? std::nullopt : std::optional(*number);
}

/// Returns the number called `key` of each record that has it.
std::vector<double> numbers_of(const RecordRefs& records, NumberMap map, const std::string& key);

/// Returns the error called `key` of each record that has it, by seed and frame.
std::map<SeedFrame, double> errors_by_case(const RecordRefs& records, const std::string& key);

/// Formats a body for readers: "camera", "object 3".
std::string body_title(const std::string& body);

/// Independent units of the bootstrap (stats/bootstrap.h): seeds, or stretches of five frames of a sequence
/// if all records have the same seed.
class Clusters {
 public:
  explicit Clusters(const RecordRefs& records);
  uint64_t of(const Record& record) const;
  bool are_frames() const { return n_seeds_ < 2; }
  int n_seeds() const { return n_seeds_; }

 private:
  std::map<std::string, uint64_t> sequences_;
  int n_seeds_;
};

/// Column titled "E_t [m]", with the decimals of the list of metrics.
Column metric_column(const MetricDefinition& metric);

// ---- Records for figures: sets of frames, each with its bodies in order.

struct BodyRecords {
  std::string title;  ///< "camera", "Obj1"
  RecordRefs records;
};

struct RecordSet {
  std::string name;   ///< used in file names: "s18"
  std::string title;  ///< "scenario s18"
  std::vector<BodyRecords> bodies;
};

/// Groups estimated records with truth by data set and sequence; the camera first, objects by id. The results
/// point into `records`.
std::vector<RecordSet> record_sets(const std::vector<Record>& records);

/// Returns the estimators in order of first appearance.
std::vector<std::string> estimators_of(const RecordSet& set);

/// Selects the records of one estimator.
RecordRefs of_estimator(const RecordRefs& records, const std::string& estimator);

}  // namespace sextant
