#pragma once

// The fields of a line of records.jsonl, spelled once. What writes, reads or lists them is a visitor with
//
//   field(name, value)                     a value that every line has
//   field(name, value, rule)               the same, of which not every one will do
//   only_if(is_there, name, value, why)    there exactly where `is_there`; `why` in words
//   unless_empty(name, value, rule)        a text that is left out where it is empty
//
// in the order of the line, behind its `schema`.

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
/// "ego", or "object:" and the digits of a number that an int holds.
bool is_body(std::string_view text);
bool is_flow_truth(std::string_view text);
bool is_count(int n);

/// Numbers of a record have a size of at most 1e100: their squares and sums are finite doubles.
inline constexpr double largest_number = 1e100;
inline bool is_number(double value) { return value >= -largest_number && value <= largest_number; }
inline constexpr const char* expected_number = "of a size of at most 1e100";
/// Whether the map `map` may hold it. Errors that lib/metrics lists are magnitudes.
bool is_number_of(std::string_view map, Interned name, double value);

/// As statistics take a number: sizes below 1e-100 are 0, so that ratios are finite doubles too.
inline double summarised(double value) { return value < 1e-100 && value > -1e-100 ? 0 : value; }

/// Sets the value of that name; or returns what would be right, in words.
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
