#pragma once

// One table, several renderings: aligned text, Markdown, CSV and JSON all come from the same object, so they
// cannot disagree. Text and Markdown round to each column's decimals; CSV and JSON keep every digit. A cell
// without a value is "-" in text and Markdown, empty in CSV and left out in JSON: never 0.

#include <concepts>
#include <optional>
#include <string>
#include <string_view>
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
  /// More than 0: for people, so many significant digits instead of `decimals`; less than 1e-5 is rounding, and 0.
  int significant = 0;
  /// Not empty: on pages the cell leads to the address that the row has in the column of this key.
  std::string leads_to{};

  static Column text(const std::string& key, const std::string& title) { return {key, title, Align::left}; }
  static Column text(const std::string& key) { return text(key, key); }
  static Column number(const std::string& key, const std::string& title, int decimals) {
    return {key, title, Align::right, decimals};
  }
  static Column number(const std::string& key, int decimals) { return number(key, key, decimals); }
  static Column count(const std::string& key, const std::string& title) { return number(key, title, 0); }
  static Column count(const std::string& key) { return count(key, key); }
  static Column p_value(const std::string& key) { return {key, "p", Align::right, 4, false, false, true}; }
  Column folded() const { return with(&Column::fold); }
  Column only_in_files() const { return with(&Column::detail); }

 private:
  Column with(bool Column::*flag) const {
    Column column = *this;
    column.*flag = true;
    return column;
  }
};

/// Texts, titled by their keys, that are said once where all rows agree.
std::vector<Column> folded_columns(const std::vector<std::string>& keys);
/// The two ends of an interval.
std::vector<Column> range_columns(const std::string& low_key, const std::string& high_key, int decimals,
                                  const std::string& title = "95 % interval");

/// Empty, text, or a finite number.
struct Cell : std::variant<std::monostate, std::string, double> {
  Cell() = default;
  Cell(const char* text) : variant(std::string(text)) {}
  Cell(std::string_view text) : variant(std::string(text)) {}
  Cell(std::string text) : variant(std::move(text)) {}
  Cell(double number) : variant(number) {}
  Cell(std::integral auto number) : variant(static_cast<double>(number)) {}
  template <typename T>
  Cell(const std::optional<T>& value) : Cell(value ? Cell(*value) : Cell()) {}
};
/// A Cell takes them by itself; where a call says so all the same.
inline Cell cell(const std::optional<double>& value) { return value; }

struct Table {
  std::string title;
  std::string caption{};  ///< one paragraph: preset, aggregate, units; below the title
  std::vector<Column> columns{};
  std::vector<std::vector<Cell>> rows{};  ///< each as long as `columns`
  std::vector<std::string> notes{};       ///< below the table, one line each

  void add_columns(std::vector<Column> more);
  /// The place of the column with that key.
  std::optional<size_t> find_column(std::string_view key) const;
  /// The same where there must be one; throws InternalError without.
  size_t place(std::string_view key) const;
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
