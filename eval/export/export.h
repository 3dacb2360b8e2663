#pragma once

// `sextant export`: the records of a run or sweep as one file for other programs, with the columns of
// RecordColumns.
//
//   csv     RFC 4180 with a header, UTF-8; numbers with the fewest digits that read back to the same double,
//           a missing value as an empty field
//   npz     numpy, without pickle: a numeric column NAME is a float64 array with NaN for missing values, a
//           count an int64 array (seed: uint64); a text column is an int32 array of indices into NAME_names,
//           -1 for missing values
//   sqlite  table `records`: TEXT, INTEGER, REAL, NULL
//
// The file is written under a temporary name and renamed. Memory use does not grow with the number of records
// (npz: 64 kB per column).

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <variant>
#include <vector>

#include "sextant/base/interned.h"
#include "sextant/base/names.h"

namespace sextant {

// ---- The records of a run or sweep as a table: one row per record, one flat column per field. The columns
// are the fields of a line (dataset, sequence, .., n_inliers, flow_truth), followed by one for every number
// that any record has in the four maps:
//
//   errors_Et_m   values_v_kmh   bound_Et_m   time_ms_total        docs/metrics.md defines them
//
// in alphabetical order within a map. A field that a record lacks is empty. The file is read twice, once for
// the columns and once for the rows, so memory use does not grow with it.

enum class ColumnKind {
  text,
  integer,           ///< int64_t
  unsigned_integer,  ///< uint64_t
  number,            ///< double
};

struct RecordColumn {
  std::string name;
  ColumnKind kind = ColumnKind::number;
};

/// Value of a field; monostate if the record lacks it.
using RecordValue = std::variant<std::monostate, Interned, int64_t, uint64_t, double>;

/// Visits one row: a value for each column.
using RowVisitor = std::function<void(std::span<const RecordValue>)>;

class RecordColumns {
 public:
  /// Reads records.jsonl in `folder` once, to find its columns. Throws Error that names file and line if a
  /// line is not a record, and Error if a sweep kept only summaries; Interrupted on Ctrl-C.
  explicit RecordColumns(const std::filesystem::path& folder);

  const std::vector<RecordColumn>& columns() const { return columns_; }
  uint64_t n_rows() const { return n_rows_; }
  /// Visits the rows in the order of the file. Throws Error if the file has changed, Interrupted on Ctrl-C.
  void for_each_row(const RowVisitor& visit) const;

 private:
  std::filesystem::path file_;
  std::vector<RecordColumn> columns_;
  std::array<std::set<Interned>, 4> names_;  ///< numbers of each NumberMap, one column each
  uint64_t n_rows_ = 0;
};

// ---- Columns as numpy stores them: numbers of eight bytes; texts as int32 indices, -1 for a missing text

/// Returns numpy's name of the type of a column's elements, e.g. "<f8".
const char* numpy_type(ColumnKind kind);

/// The distinct texts of a column in order of first appearance.
struct DistinctTexts {
  std::vector<Interned> all;
  std::unordered_map<const std::string*, int32_t> places;

  int32_t place(Interned text) {
    const auto [it, is_new] = places.emplace(&text.str(), static_cast<int32_t>(all.size()));
    if (is_new) all.push_back(text);
    return it->second;
  }
};

/// Calls `put` with the value in the type of its column; `texts` are those of the column.
template <typename Put>
void put_numpy(const RecordValue& value, ColumnKind kind, DistinctTexts& texts, const Put& put) {
  if (kind == ColumnKind::text) {
    const auto* text = std::get_if<Interned>(&value);
    put(text == nullptr ? int32_t{-1} : texts.place(*text));
  } else if (const auto* integer = std::get_if<int64_t>(&value)) {
    put(*integer);
  } else if (const auto* unsigned_integer = std::get_if<uint64_t>(&value)) {
    put(*unsigned_integer);
  } else {
    const auto* number = std::get_if<double>(&value);
    put(number == nullptr ? NAN : double{*number});
  }
}

// ---- Files

enum class ExportFormat { csv, npz, sqlite };
constexpr Names<3> names_of(ExportFormat) { return {"csv", "npz", "sqlite"}; }

struct ExportOutcome {
  uint64_t n_records = 0;
  size_t n_columns = 0;
};

/// Writes or replaces `out`. Throws Error if the records cannot be read or `out` cannot be written,
/// Interrupted on Ctrl-C; `out` is then unchanged.
ExportOutcome export_records(const std::filesystem::path& folder, ExportFormat format,
                             const std::filesystem::path& out, bool quiet = true);

}  // namespace sextant
