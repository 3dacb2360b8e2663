#pragma once

// What every table asks of a record.

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/table.h"
#include "sextant/stats/clustered_sample.h"

namespace sextant {

using RecordRefs = std::vector<const Record*>;

/// What a map has under that key; null where it has none.
template <typename Map>
const typename Map::mapped_type* find_in(const Map& map, const typename Map::key_type& key) {
  const auto it = map.find(key);
  return it == map.end() ? nullptr : &it->second;
}

/// The keys that all of these maps have, in order: the cases in which they can be compared.
template <typename Map>
std::vector<typename Map::key_type> common_keys(const std::vector<const Map*>& maps) {
  std::vector<typename Map::key_type> keys;
  for (const auto& [key, value] : *maps.front()) {
    if (std::ranges::all_of(maps, [&key = key](const Map* map) { return map->contains(key); }))
      keys.push_back(key);
  }
  return keys;
}

/// What these have under that member, each value once, in order of first appearance.
template <typename Item, typename Text>
std::vector<std::string> distinct(const std::vector<const Item*>& items, Text Item::*member) {
  std::vector<std::string> values;
  for (const Item* item : items) {
    const std::string& value = item->*member;
    if (std::ranges::find(values, value) == values.end()) values.push_back(value);
  }
  return values;
}

/// A draw of the noise and a frame: what estimators are paired by.
using SeedFrame = std::pair<uint64_t, int>;

/// The number of that name, if the record has it.
template <typename Map>
std::optional<double> find_number(const Map& numbers, const typename Map::key_type& key) {
  const double* number = find_in(numbers, key);
  return number == nullptr ? std::nullopt : std::optional(*number);
}

/// The numbers of that name of the records that have it.
std::vector<double> numbers_of(const RecordRefs& records, NumberMap map, const std::string& key);

/// One error of the records that have it.
std::map<SeedFrame, double> errors_by_case(const RecordRefs& records, const std::string& key);

/// Has one of the errors that are compared (metrics/definitions.h).
bool has_compared_error(const Record& record);

/// "camera", "object 3".
std::string body_title(const std::string& body);

/// What was drawn independently (stats/bootstrap.h): a seed; of records that all have the same seed, a frame.
class Clusters {
 public:
  explicit Clusters(const RecordRefs& records);
  uint64_t of(const Record& record) const;
  bool are_frames() const { return n_seeds_ < 2; }
  int n_seeds() const { return n_seeds_; }

 private:
  int n_seeds_;
};

/// One error of the records that have it, ready for intervals.
struct ErrorSample {
  std::vector<double> values;
  std::vector<uint64_t> clusters;
};
ErrorSample error_sample(const RecordRefs& records, const std::string& key, const Clusters& clusters);

/// "E_t [m]", with the digits of the list.
Column metric_column(const MetricDefinition& metric);
/// Its two ends as cells; empty ones where there is none.
void add_interval(const std::optional<Interval>& interval, std::vector<Cell>& cells);
/// The value and the two ends.
void add_estimate(const std::optional<IntervalEstimate>& estimate, std::vector<Cell>& cells);

}  // namespace sextant
