#pragma once

// What the renderings of a table for people (text, Markdown, LaTeX, HTML) have in common.

#include <string>
#include <vector>

#include "sextant/eval/report/table.h"

namespace sextant {

/// Rounded to the column's decimals or significant digits; "-" for an empty cell.
std::string shown(const Cell& cell, const Column& column);

/// Without details, two columns of a range as one.
Table for_people(const Table& table);

struct FoldedTable {
  Table table;
  std::string said_once;  ///< "dataset vdo, sequence 0003"
};
/// Takes out the columns marked `fold` that say the same in every row.
FoldedTable fold_columns(const Table& table);

/// At most `width` characters a line where words allow it, broken at blanks; lines after the first begin with `indent`.
std::string wrapped(const std::string& text, size_t width, const std::string& indent = "");

/// Those of the columns with these keys, in the table's order.
Table with_columns(const Table& table, const std::vector<std::string>& keys);

}  // namespace sextant
