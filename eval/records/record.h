#pragma once

// A record says what one estimator made of one body in one frame pair: one line of records.jsonl. Tables,
// figures and comparisons are functions of records, so they can be redone without running anything.
//
//   {"schema":1,"dataset":"synthetic","sequence":"s18",...,"errors":{"ER_deg":0.01,"Et_m":0.02},...}
//
// The keys of a line are the members of Record, in the order of record_fields.h; those inside the four maps are
// in alphabetical order. docs/metrics.md defines every one of them, those of the maps from the list in
// metrics/definitions.h. A number that is not finite is left out: never NaN, null or 0 in its place. Doubles are
// written with the fewest digits that read back to the same value.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/interned.h"
#include "sextant/base/options.h"
#include "sextant/base/status.h"
#include "sextant/eval/records/named_numbers.h"
#include "sextant/metrics/definitions.h"
#include "sextant/metrics/pose_change.h"

namespace sextant {

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
  Interned flow_truth;  ///< "given" or "induced"; empty (not written) when the record has no EPE
  Numbers errors;
  Numbers values;
  Numbers bound;
  Numbers time_ms;

  bool operator==(const Record&) const = default;
  bool is_ego() const { return body == "ego"; }
  const Numbers& numbers(NumberMap map) const;
};

/// The keys of a line, in order.
const std::vector<std::string>& record_field_names();

/// "values.altitude_m": keys in the four maps that the list of metrics lacks. Records of others may have them.
std::vector<std::string> unlisted_keys(const std::vector<Record>& records);
/// Throws InternalError that names them: for whatever makes records.
void check_listed(const std::vector<Record>& records);

/// "object:ID".
std::string object_body(int id);

Json to_json(const Record& record);
/// Strict: a missing, unknown or ill-typed key throws Error that begins with `where` ("FILE:LINE").
Record record_from_json(const Json& json, const std::string& where);

/// One line a record, each ended by a newline.
std::string write_records(const std::vector<Record>& records);
/// `name` is used in messages as "NAME:LINE: ...". An unfinished last line is an error.
std::vector<Record> parse_records(std::string_view text, const std::string& name);
std::vector<Record> read_records(const std::filesystem::path& path);

/// The record without what differs from run to run on the same input: its times, and peak_memory_mb.
Record strip_times(Record record);

/// As "EtFRAME_m" and "ERFRAME_deg".
void put(const PoseChangeError& error, const std::string& frame, Record::Numbers& numbers);

/// Truth in both frames, and worth estimating: an object that is static by truth is not.
bool has_truth(const Record& record);

/// Where a body stands in tables: 0 for ego, else its id.
int body_order(Interned body);

}  // namespace sextant
