#pragma once

// The records of a run or sweep as a table: one row a record, one flat column a field. Columns are those of a
// line (dataset, sequence, .., n_inliers, flow_truth), then one for every number that any record has in the
// four maps:
//
//   errors_Et_m   values_v_kmh   bound_Et_m   time_ms_total        docs/metrics.md defines them
//
// in alphabetical order within a map. What a record lacks is an empty value. The file is read twice, once for
// the columns and once for the rows, so memory does not grow with it.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "sextant/base/interned.h"

namespace sextant {

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

/// Empty: the record has none.
using RecordValue = std::variant<std::monostate, Interned, int64_t, uint64_t, double>;

/// One row: a value for each column.
using RowVisitor = std::function<void(std::span<const RecordValue>)>;

class RecordColumns {
 public:
  /// records.jsonl of `folder`. Throws Error that names file and line, and where a sweep kept summaries
  /// alone.
  explicit RecordColumns(const std::filesystem::path& folder);

  const std::vector<RecordColumn>& columns() const { return columns_; }
  uint64_t n_rows() const { return n_rows_; }
  /// In order of the file. Throws Error when it is not what it was, Interrupted on Ctrl-C.
  void for_each_row(const RowVisitor& visit) const;

 private:
  std::filesystem::path file_;
  std::vector<RecordColumn> columns_;
  uint64_t n_rows_ = 0;
};

}  // namespace sextant
