#pragma once

// The records of a run or sweep as a table: one row per record, one flat column per field. The columns are
// those of a line (dataset, sequence, .., n_inliers, flow_truth), followed by one for every number that any
// record has in the four maps:
//
//   errors_Et_m   values_v_kmh   bound_Et_m   time_ms_total        docs/metrics.md defines them
//
// in alphabetical order within a map. A field that a record lacks is empty. The file is read twice, once for
// the columns and once for the rows, so memory use does not grow with it.

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
  uint64_t n_rows_ = 0;
};

}  // namespace sextant
