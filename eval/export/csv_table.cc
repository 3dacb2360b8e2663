#include "sextant/base/files.h"
#include "sextant/eval/export/table_writers.h"
#include "sextant/eval/records/csv_field.h"

#include <fmt/format.h>

namespace sextant {
namespace {

void append_field(std::string& line, const RecordValue& value) {
  if (const auto* text = std::get_if<Interned>(&value)) {
    line += csv_field(text->str());
  } else if (const auto* count = std::get_if<int64_t>(&value)) {
    fmt::format_to(std::back_inserter(line), "{}", *count);
  } else if (const auto* large = std::get_if<uint64_t>(&value)) {
    fmt::format_to(std::back_inserter(line), "{}", *large);
  } else if (const auto* number = std::get_if<double>(&value)) {
    fmt::format_to(std::back_inserter(line), "{}", *number);
  }
}

}  // namespace

void write_csv(const RecordColumns& records, const Rows& rows, const fs::path& file) {
  StreamedFile csv(file);
  std::string line;
  for (const RecordColumn& column : records.columns())
    line.append(line.empty() ? 0 : 1, ',').append(csv_field(column.name));
  csv.append(line + "\n");
  rows([&](std::span<const RecordValue> row) {
    line.clear();
    for (size_t i = 0; i < row.size(); ++i) {
      if (i > 0) line += ',';
      append_field(line, row[i]);
    }
    line += '\n';
    csv.append(line);
  });
  csv.close();
}

}  // namespace sextant
