#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/eval/export/record_columns.h"

#include <fmt/format.h>

namespace sextant {
namespace {

void append_field(std::string& line, const RecordValue& value) {
  const auto append = [&](const auto& given) {
    using Value = std::decay_t<decltype(given)>;
    if constexpr (std::is_same_v<Value, Interned>) line += csv_field(given.str());
    if constexpr (std::is_arithmetic_v<Value>) fmt::format_to(std::back_inserter(line), "{}", given);
  };
  std::visit(append, value);
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
