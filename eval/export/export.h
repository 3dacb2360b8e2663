#pragma once

// `sextant export`: the records of a run or sweep as one file that other programs read. Columns:
// record_columns.h.
//
//   csv     RFC 4180 with a header, UTF-8; numbers with the fewest digits that read back to the same double,
//           a value that is
//           not there as an empty field
//   npz     numpy, without pickle: a column NAME of numbers is a float64 array with NaN where a record has
//           none, one of counts
//           int64 (seed uint64); one of texts an int32 array of places in NAME_names, -1 where a record has
//           none
//   sqlite  table `records`: TEXT, INTEGER, REAL, NULL
//
// Written to a temporary name and renamed. Memory does not grow with the number of records (of npz: 64 kB a
// column).

#include <cstdint>
#include <filesystem>

#include "sextant/base/names.h"

namespace sextant {

enum class ExportFormat { csv, npz, sqlite };
constexpr Names<3> names_of(ExportFormat) { return {"csv", "npz", "sqlite"}; }

struct ExportOutcome {
  uint64_t n_records = 0;
  size_t n_columns = 0;
};

/// Replaces `out`. Throws Error, Interrupted on Ctrl-C; `out` is then as it was.
ExportOutcome export_records(const std::filesystem::path& folder, ExportFormat format,
                             const std::filesystem::path& out, bool quiet = true);

}  // namespace sextant
