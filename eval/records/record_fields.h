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
};
/// "ego", or "object:" and digits.
bool is_body(std::string_view text);
bool is_flow_truth(std::string_view text);
bool is_count(int n);

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
  v.field("level", r.level);
  v.field("seed", r.seed);
  v.field("frame", r.frame);
  v.field("body", r.body, Text{is_body, "ego or object:ID"});
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
