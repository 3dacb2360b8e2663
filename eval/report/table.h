#pragma once

// One table, several renderings: aligned text, Markdown, CSV and JSON all come from the same object, so they
// cannot disagree. Text and Markdown round to each column's decimals; CSV and JSON keep every digit. A cell
// without a value is "-" in text and Markdown, empty in CSV and left out in JSON: never 0.

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sextant/base/options.h"

namespace sextant {

enum class Align { left, right };

struct Column {
  std::string key;    ///< machine name, with unit suffix: CSV header and JSON key
  std::string title;  ///< as people read it, with unit: "E_t [m]"
  Align align = Align::right;
  int decimals = 3;  ///< of numbers in text and Markdown
  /// to_text: said once above the table, not in a column, when all rows agree; empty: not at all.
  bool fold = false;
  bool detail = false;  ///< only in CSV and JSON
  /// Text and Markdown: "<0.0001" for a positive number that rounds to 0, as for p-values.
  bool below = false;
  /// Not empty: for people, this and the next column are one, "[low, high]", under this title.
  std::string range{};
  bool says_itself = false;  ///< `fold` says its text without the title
  /// More than 0: for people, so many significant digits instead of `decimals`.
  int significant = 0;
};

/// Texts, titled by their keys, that are said once where all rows agree.
std::vector<Column> folded_columns(const std::vector<std::string>& keys);
/// The two ends of an interval.
std::vector<Column> range_columns(const std::string& low_key, const std::string& high_key, int decimals,
                                  const std::string& title = "95 % interval");

/// Empty, text, or a finite number.
using Cell = std::variant<std::monostate, std::string, double>;

/// The value, or an empty cell.
Cell cell(const std::optional<double>& value);

struct Table {
  std::string title;
  std::string caption{};  ///< one paragraph: preset, aggregate, units; below the title
  std::vector<Column> columns{};
  std::vector<std::vector<Cell>> rows{};  ///< each as long as `columns`
  std::vector<std::string> notes{};       ///< below the table, one line each

  void add_columns(std::vector<Column> more);
  /// Throws InternalError when the row's length is wrong or a number is not finite.
  void add_row(std::vector<Cell> row);
};

/// The runs of rows that agree in these columns, each with title, caption and notes of the whole; so that
/// `fold` says once what they agree in.
std::vector<Table> split_rows(const Table& table, const std::vector<std::string>& keys);

std::string to_text(const Table& table);
std::string to_markdown(const Table& table);
/// A text, whosever it is, as one line of Markdown in which nothing is HTML.
std::string markdown_text(const std::string& text);
/// RFC 4180, header line first; title, caption and notes are not written.
std::string to_csv(const Table& table);
/// An array with one object a row.
Json rows_to_json(const Table& table);

}  // namespace sextant
