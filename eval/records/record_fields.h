#pragma once

// The fields of a line of records.jsonl, defined once. Writers, readers and listings are visitors with
//
//   field(name, value)                     a value that every line has
//   field(name, value, rule)               a value that every line has, restricted by a rule
//   only_if(is_there, name, value, why)    present exactly if `is_there`; `why` is the reason in words
//   unless_empty(name, value, rule)        a text that is left out if it is empty
//
// called in the order of the line, after its `schema`.

#include <string_view>

#include "sextant/eval/records/record.h"

namespace sextant::internal {

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
/// Returns true if the map `map` may contain the value. Errors listed in lib/metrics must not be negative.
bool is_number_of(std::string_view map, Interned name, double value);

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
