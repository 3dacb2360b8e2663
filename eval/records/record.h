#pragma once

// A record is the result of one estimator for one body in one frame pair: one line of records.jsonl. Tables,
// figures and comparisons are functions of records, so they can be repeated without running an estimator.
//
//   {"schema":1,"dataset":"synthetic","sequence":"s18",...,"errors":{"ER_deg":0.01,"Et_m":0.02},...}
//
// The keys of a line are the members of Record, in the order of for_each_field() below; keys inside the four
// maps are in alphabetical order. docs/metrics.md defines all of them, those of the maps from the list in
// metrics/definitions.h. A number that is not finite is left out: it is never written as NaN, null or 0.
// Doubles are written with the fewest digits that read back to the same value.

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/interned.h"
#include "sextant/base/options.h"
#include "sextant/base/status.h"
#include "sextant/metrics/definitions.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {

/// A few numbers by name, sorted by name: a map in contiguous memory with 16 bytes per number.
class NamedNumbers {
 public:
  using key_type = Interned;
  using mapped_type = double;
  using value_type = std::pair<Interned, double>;
  using iterator = std::vector<value_type>::iterator;
  using const_iterator = std::vector<value_type>::const_iterator;

  NamedNumbers() = default;
  NamedNumbers(std::initializer_list<value_type> numbers) { insert(numbers.begin(), numbers.end()); }
  bool operator==(const NamedNumbers&) const = default;

  const_iterator begin() const { return numbers_.begin(); }
  const_iterator end() const { return numbers_.end(); }
  size_t size() const { return numbers_.size(); }
  bool empty() const { return numbers_.empty(); }
  void clear() { numbers_.clear(); }

  const_iterator find(Interned name) const { return std::ranges::find(numbers_, name, &value_type::first); }
  bool contains(Interned name) const { return find(name) != end(); }
  double at(Interned name) const {
    const auto it = find(name);
    SEXTANT_CHECK(it != end());
    return it->second;
  }
  double& operator[](Interned name) { return emplace(name, 0.0).first->second; }

  /// Inserts a number unless the name exists.
  std::pair<iterator, bool> emplace(Interned name, double number) {
    const auto known = std::ranges::find(numbers_, name, &value_type::first);
    if (known != numbers_.end()) return {known, false};
    const auto is_before = [](const value_type& item, Interned other) { return item.first < other; };
    return {
        numbers_.emplace(std::lower_bound(numbers_.begin(), numbers_.end(), name, is_before), name, number),
        true};
  }
  template <typename Iterator>
  void insert(Iterator first, Iterator last) {
    for (; first != last; ++first) emplace(first->first, first->second);
  }
  /// Appends a number if its name comes after all others; otherwise returns false.
  bool append(Interned name, double number) {
    if (!empty() && !(numbers_.back().first < name)) return false;
    numbers_.emplace_back(name, number);
    return true;
  }

  void erase(Interned name) {
    std::erase_if(numbers_, [&](const value_type& item) { return item.first == name; });
  }
  template <typename Condition>
  friend void erase_if(NamedNumbers& numbers, const Condition& condition) {
    std::erase_if(numbers.numbers_, condition);
  }

 private:
  std::vector<value_type> numbers_;
};

/// Returns the value of a map under `key`; null if there is none.
template <typename Map>
const typename Map::mapped_type* find_in(const Map& map, const typename Map::key_type& key) {
  const auto it = map.find(key);
  return it == map.end() ? nullptr : &it->second;
}

struct Record {
  using Numbers = NamedNumbers;

  Interned dataset;
  Interned sequence;
  Interned estimator;
  Interned noise = "none";
  double level = 0;
  uint64_t seed = 0;
  int frame = 0;  ///< the current frame k of the pair (k-1, k)
  Interned body;  ///< "ego" or "object:ID"
  Status status = Status::ok;
  Gate gate = Gate::none;  ///< written only when status is `gated`
  int n_points = 0;
  int n_inliers = 0;
  Interned flow_truth;  ///< "given" or "induced"; empty (not written) if the record has no EPE
  Numbers errors;
  Numbers values;
  Numbers bound;
  Numbers time_ms;

  bool operator==(const Record&) const = default;
  bool is_ego() const { return body == "ego"; }
  const Numbers& numbers(NumberMap map) const;
};

/// Returns the keys of a line, in order.
const std::vector<std::string>& record_field_names();

/// Returns the keys in the four maps that the list of metrics lacks, as "values.altitude_m". Third-party
/// records may have such keys.
std::vector<std::string> unlisted_keys(const std::vector<Record>& records);
/// Throws InternalError that names unlisted keys; called by code that creates records.
void check_listed(const std::vector<Record>& records);

/// Returns "object:ID".
std::string object_body(int id);

Json to_json(const Record& record);
/// Parses a record strictly: a missing, unknown or ill-typed key throws Error that begins with `where`
/// ("FILE:LINE").
Record record_from_json(const Json& json, const std::string& where);

/// Returns the record without the numbers that vary between runs on the same input: times and peak_memory_mb.
Record strip_times(Record record);

/// Stores an error as "EtFRAME_m" and "ERFRAME_deg".
void put(const PoseChangeError& error, const std::string& frame, Record::Numbers& numbers);

/// Returns true if the body has truth in both frames and should be estimated: the camera if the record has
/// step_gt_m; an object if it is not static by truth (dynamic_gt = 0) and the record has distance_gt_m or,
/// like records from logs of other systems, v_gt_kmh or any error of its motion.
bool has_truth(const Record& record);
/// Returns true if the motion is estimated and compared with truth (status ok), but the record has no error
/// of it. This program writes no such record; tables would count it as estimated, and means would lack it.
bool lacks_errors(const Record& record);

/// Returns the position of a body in tables: 0 for ego, otherwise its id.
int body_order(Interned body);

}  // namespace sextant

namespace sextant::internal {

// ---- The fields of a line of records.jsonl, defined once. Writers, readers and listings are visitors with
//
//   field(name, value)                     a value that every line has
//   field(name, value, rule)               a value that every line has, restricted by a rule
//   only_if(is_there, name, value, why)    present exactly if `is_there`; `why` is the reason in words
//   unless_empty(name, value, rule)        a text that is left out if it is empty
//
// called in the order of the line, after its `schema`.

constexpr int record_schema = 1;

template <typename T>
struct FieldRule {
  bool (*holds)(T value);
  const char* expected;  ///< in words

  bool allows(T value) const { return holds(value); }
  bool allows(Interned value) const requires std::is_same_v<T, std::string_view> {
    return holds(value.str());
  }
};
/// Returns true for "ego", and for "object:" followed by the digits of an int.
bool is_body(std::string_view text);
bool is_flow_truth(std::string_view text);
bool is_count(int n);

/// Bound on the magnitude of a record's numbers, so that their squares and sums are finite doubles.
inline constexpr double largest_number = 1e100;
inline bool is_number(double value) { return value >= -largest_number && value <= largest_number; }
inline constexpr const char* expected_number = "of a size of at most 1e100";
/// Returns true if the map `map` may contain the value. Errors must not be negative.
bool is_number_of(std::string_view map, double value);

/// Returns the number as used by statistics: magnitudes below 1e-100 become 0, so that ratios are finite
/// doubles too.
inline double summarised(double value) { return value < 1e-100 && value > -1e-100 ? 0 : value; }

/// Sets the value with this name and returns null, or returns a description of the expected text.
const char* from_text(std::string_view text, Status& status);
const char* from_text(std::string_view text, Gate& gate);

template <typename R, typename V>
void visit_fields(R& r, V& v) {
  using Text = FieldRule<std::string_view>;
  using Count = FieldRule<int>;
  v.field("dataset", r.dataset);
  v.field("sequence", r.sequence);
  v.field("estimator", r.estimator);
  v.field("noise", r.noise);
  v.field("level", r.level, FieldRule<double>{is_number, expected_number});
  v.field("seed", r.seed);
  v.field("frame", r.frame);
  v.field("body", r.body, Text{is_body, "ego or object:ID, ID from 0 to 2147483647"});
  v.field("status", r.status);
  v.only_if(r.status == Status::gated, "gate", r.gate, "belongs to status 'gated' and to no other");
  v.field("n_points", r.n_points, Count{is_count, "a count >= 0"});
  v.field("n_inliers", r.n_inliers, Count{is_count, "a count >= 0"});
  v.unless_empty("flow_truth", r.flow_truth, Text{is_flow_truth, "given or induced"});
  v.field("errors", r.errors);
  v.field("values", r.values);
  v.field("bound", r.bound);
  v.field("time_ms", r.time_ms);
}

}  // namespace sextant::internal
