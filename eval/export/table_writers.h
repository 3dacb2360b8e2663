#pragma once

// One function a format of export.h. `file` is a temporary name, except npz's, which has one of its own.

#include <filesystem>

#include "sextant/eval/export/record_columns.h"

namespace sextant {

/// Goes over the rows.
using Rows = std::function<void(const RowVisitor&)>;

void write_csv(const RecordColumns& records, const Rows& rows, const std::filesystem::path& file);
void write_npz(const RecordColumns& records, const Rows& rows, const std::filesystem::path& file);
void write_sqlite(const RecordColumns& records, const Rows& rows, const std::filesystem::path& file);

}  // namespace sextant
