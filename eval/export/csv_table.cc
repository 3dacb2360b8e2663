#include "sextant/base/files.h"
#include "sextant/base/new_file.h"
#include "sextant/base/spreadsheet.h"
#include "sextant/eval/export/record_columns.h"

#include <fmt/format.h>

namespace sextant {
namespace {

void append_field(std::string& line, const RecordValue& value) {
  const auto append = [&](const auto& given) {
    using Value = std::decay_t<decltype(given)>;
    if constexpr (std::is_same_v<Value, Interned>) line += spreadsheet_field(given.str());
    if constexpr (std::is_arithmetic_v<Value>) fmt::format_to(std::back_inserter(line), "{}", given);
  };
  std::visit(append, value);
}

}  // namespace

void write_csv(const RecordColumns& records, const Rows& rows, const fs::path& file) {
  constexpr size_t buffer_bytes = size_t{1} << 20U;
  NewFile csv(file);
  std::string line, buffer;
  for (const RecordColumn& column : records.columns())
    line.append(line.empty() ? 0 : 1, ',').append(spreadsheet_field(column.name));
  buffer = line + "\n";
  rows([&](std::span<const RecordValue> row) {
    line.clear();
    for (size_t i = 0; i < row.size(); ++i) {
      if (i > 0) line += ',';
      append_field(line, row[i]);
    }
    line += '\n';
    buffer += line;
    if (buffer.size() < buffer_bytes) return;
    csv.append(buffer);
    buffer.clear();
  });
  csv.append(buffer);
  csv.commit();
}

}  // namespace sextant
