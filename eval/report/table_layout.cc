#include "sextant/eval/report/table_layout.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"

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

}  // namespace

std::string shown(const Cell& cell, const Column& column) {
  if (const auto* text = std::get_if<std::string>(&cell)) return text->empty() ? "-" : *text;
  const auto* number = std::get_if<double>(&cell);
  if (number == nullptr) return "-";
  const double half_unit = 0.5 * std::pow(10.0, -column.decimals);
  if (column.below && *number > 0 && *number < half_unit) {
    return fmt::format("<{:.{}f}", 2 * half_unit, column.decimals);
  }
  const bool is_zero = std::abs(*number) < half_unit;  // not "-0.000"
  return fmt::format("{:.{}f}", is_zero ? 0.0 : *number, column.decimals);
}

Table without_details(const Table& table) {
  return without_columns(table, [&](size_t j) { return table.columns[j].detail; });
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
    if (!folds(j) || std::holds_alternative<std::monostate>(cell)) continue;
    said_once +=
        (said_once.empty() ? "" : ", ") + table.columns[j].title + " " + shown(cell, table.columns[j]);
  }
  return {without_columns(table, folds), said_once};
}

}  // namespace sextant
