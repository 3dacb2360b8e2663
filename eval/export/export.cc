#include "sextant/eval/export/export.h"

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/progress.h"
#include "sextant/eval/export/record_columns.h"

namespace sextant {

ExportOutcome export_records(const fs::path& folder, ExportFormat format, const fs::path& out, bool quiet) {
  std::error_code ignored;
  if (fs::is_directory(out, ignored)) fail("{}: is a folder: expected the name of a file", out.string());
  const fs::path parent = out.has_parent_path() ? out.parent_path() : fs::path(".");
  if (!fs::is_directory(parent, ignored)) fail("{}: there is no folder {}", out.string(), parent.string());
  const RecordColumns records(folder);
  constexpr int step = 1000;
  Progress progress("thousand records", static_cast<int>(records.n_rows() / step), quiet);
  const Rows rows = [&](const RowVisitor& visit) {
    uint64_t n = 0;
    records.for_each_row([&](std::span<const RecordValue> row) {
      visit(row);
      if (++n % step == 0) progress.advance();
    });
  };
  constexpr decltype(&write_csv) writers[] = {write_csv, write_npz, write_sqlite};  // by ExportFormat
  writers[static_cast<size_t>(format)](records, rows, out);
  sync_folder(out.has_parent_path() ? out.parent_path() : fs::path("."));
  return {records.n_rows(), records.columns().size()};
}

}  // namespace sextant
