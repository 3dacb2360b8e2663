#pragma once

// `sextant export`: the records of a run or sweep as one file for other programs, with the columns of
// record_columns.h.
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

/// Writes or replaces `out`. Throws Error if the records cannot be read or `out` cannot be written,
/// Interrupted on Ctrl-C; `out` is then unchanged.
ExportOutcome export_records(const std::filesystem::path& folder, ExportFormat format,
                             const std::filesystem::path& out, bool quiet = true);

}  // namespace sextant
