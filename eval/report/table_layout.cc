#include "sextant/eval/report/table_layout.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

/// Without the columns for which `leave_out(column index)` holds.
template <typename Predicate>
Table without_columns(Table table, const Predicate& leave_out) {
  for (size_t j = table.columns.size(); j-- > 0;) {
    if (!leave_out(j)) continue;
    const auto at = static_cast<std::ptrdiff_t>(j);
    table.columns.erase(table.columns.begin() + at);
    for (std::vector<Cell>& row : table.rows) row.erase(row.begin() + at);
  }
  return table;
}

/// Columns j and j + 1 as one of text.
void join_range(Table& table, size_t j) {
  const Column low = table.columns[j];
  const Column high = table.columns[j + 1];
  for (std::vector<Cell>& row : table.rows) {
    const bool is_empty =
        std::holds_alternative<std::monostate>(row[j]) && std::holds_alternative<std::monostate>(row[j + 1]);
    row[j] = is_empty ? Cell() : Cell(fmt::format("[{}, {}]", shown(row[j], low), shown(row[j + 1], high)));
    row.erase(row.begin() + static_cast<std::ptrdiff_t>(j) + 1);
  }
  table.columns[j].title = low.range;
  table.columns.erase(table.columns.begin() + static_cast<std::ptrdiff_t>(j) + 1);
}

/// 0.000178, 0.0886, -51.2, 195, 2430: no exponent where a person would write none.
std::string rounded_to_digits(double number, int digits) {
  constexpr double rounding = 1e-5;  // differences of equal numbers, in any unit that claims have
  const double size = std::abs(number);
  if (size < rounding) return "0";
  const int before = static_cast<int>(std::floor(std::log10(size))) + 1;
  return fmt::format("{:.{}f}", number, std::max(0, digits - before));
}

}  // namespace

std::string shown(const Cell& cell, const Column& column) {
  if (const auto* text = std::get_if<std::string>(&cell)) return text->empty() ? "-" : one_line(*text);
  const auto* number = std::get_if<double>(&cell);
  if (number == nullptr) return "-";
  if (column.significant > 0) return rounded_to_digits(*number, column.significant);
  const double half_unit = 0.5 * std::pow(10.0, -column.decimals);
  if (column.below && *number > 0 && *number < half_unit) {
    return fmt::format("<{:.{}f}", 2 * half_unit, column.decimals);
  }
  const bool is_zero = std::abs(*number) < half_unit;  // not "-0.000"
  return fmt::format("{:.{}f}", is_zero ? 0.0 : *number, column.decimals);
}

Table for_people(const Table& whole) {
  Table table = without_columns(whole, [&](size_t j) { return whole.columns[j].detail; });
  for (size_t j = 0; j + 1 < table.columns.size(); ++j) {
    if (!table.columns[j].range.empty()) join_range(table, j);
  }
  return table;
}

FoldedTable fold_columns(const Table& table) {
  if (table.rows.empty()) return {table, ""};
  const auto folds = [&](size_t j) {
    return table.columns[j].fold && std::ranges::all_of(table.rows, [&](const std::vector<Cell>& row) {
             return row[j] == table.rows.front()[j];
           });
  };
  std::string said_once;
  for (size_t j = 0; j < table.columns.size(); ++j) {
    const Cell& cell = table.rows.front()[j];
    if (!folds(j) || shown(cell, table.columns[j]) == "-") continue;
    if (!said_once.empty()) said_once += ", ";
    if (!table.columns[j].says_itself) said_once += table.columns[j].title + " ";
    said_once += shown(cell, table.columns[j]);
  }
  return {without_columns(table, folds), said_once};
}

std::string wrapped(const std::string& text, size_t width, const std::string& indent) {
  std::string out;
  size_t at = 0;  // characters in the present line
  for (const std::string& line : split(text, '\n')) {
    if (!out.empty()) out += '\n';
    at = 0;
    for (const std::string& word : split(line, ' ')) {
      const auto length = static_cast<size_t>(std::ranges::count_if(
          word, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
      const bool is_first = at == 0;
      if (!is_first && at + 1 + length > width) {
        out += "\n" + indent;
        at = indent.size();
      } else if (!is_first) {
        out += ' ';
        ++at;
      }
      out += word;
      at += length;
    }
  }
  return out;
}

Table with_columns(const Table& table, const std::vector<std::string>& keys) {
  return without_columns(table,
                         [&](size_t j) { return std::ranges::find(keys, table.columns[j].key) == keys.end(); });
}

}  // namespace sextant
