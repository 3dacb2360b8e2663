#pragma once

// One table, several renderings: aligned text, Markdown, CSV and JSON all come from the same object, so they
// cannot disagree. Text and Markdown round to each column's decimals; CSV and JSON keep every digit. A cell
// without a value is "-" in text and Markdown, empty in CSV and left out in JSON: never 0.

#include <concepts>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sextant/base/interned.h"
#include "sextant/base/options.h"
#include "sextant/stats/bootstrap.h"

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
  /// More than 0: for people, so many significant digits instead of `decimals`; less than 1e-5 is rounding,
  /// and 0.
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
  /// On pages the cell leads to the address in the column of that key.
  Column leading_to(const std::string& address_key) const {
    Column column = *this;
    column.leads_to = address_key;
    return column;
  }

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
  Cell(Interned text) : variant(text.str()) {}
  Cell(double number) : variant(number) {}
  Cell(std::integral auto number) : variant(static_cast<double>(number)) {}
  template <typename T>
  Cell(const std::optional<T>& value) : Cell(value ? Cell(*value) : Cell()) {}
};

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

/// A column, and the cell that it has of a row of a plain struct.
template <typename Row>
struct Field {
  Column column;
  std::function<Cell(const Row&)> of;  ///< a member, or a function of the row
};

/// The columns of a table of `Row`, in order, each declared once with what it shows.
template <typename Row>
class Fields : public std::vector<Field<Row>> {
 public:
  using std::vector<Field<Row>>::vector;

  Fields& add(Column column, std::function<Cell(const Row&)> of) {
    this->push_back({std::move(column), std::move(of)});
    return *this;
  }
  Fields& add(const Fields& more) {
    this->insert(this->end(), more.begin(), more.end());
    return *this;
  }
  /// Columns of a part of the row: `find` returns a pointer to it or an optional; without it the cells are
  /// empty.
  template <typename Part, typename Find>
  Fields& add(const Fields<Part>& more, const Find& find) {
    for (const Field<Part>& field : more) {
      add(field.column, [find, of = field.of](const Row& row) {
        const auto part = std::invoke(find, row);
        return part ? of(*part) : Cell();
      });
    }
    return *this;
  }
  /// The two ends of the interval that `find` returns as an optional; `ends`: range_columns(), or any two.
  template <typename Find>
  Fields& add_range(const std::vector<Column>& ends, const Find& find) {
    return add(Fields<Interval>{{ends.at(0), &Interval::low}, {ends.at(1), &Interval::high}}, find);
  }
};

/// The value and its 95 % interval in one column and a range.
Fields<IntervalEstimate> estimate_fields(const Column& value, const std::string& low_key,
                                         const std::string& high_key);

/// One row of cells for each of `rows`, which are rows or pointers to rows.
template <typename Row, typename Item>
Table table_of(std::string title, std::string caption, const Fields<Row>& fields,
               const std::vector<Item>& rows) {
  Table table{std::move(title), std::move(caption)};
  for (const Field<Row>& field : fields) table.columns.push_back(field.column);
  for (const Item& item : rows) {
    std::vector<Cell> cells;
    for (const Field<Row>& field : fields) {
      if constexpr (std::is_pointer_v<Item>) cells.push_back(field.of(*item));
      else cells.push_back(field.of(item));
    }
    table.add_row(std::move(cells));
  }
  return table;
}

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
/// json_text(rows_to_json(table)), made row by row: the object of all rows takes ten times the memory of its text.
std::string rows_to_json_text(const Table& table);

// ---- What the renderings of a table for people (text, Markdown, LaTeX, HTML) have in common.

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

/// At most `width` characters a line where words allow it, broken at blanks; lines after the first begin
/// with `indent`.
std::string wrapped(const std::string& text, size_t width, const std::string& indent = "");

/// Those of the columns with these keys, in the table's order.
Table with_columns(const Table& table, const std::vector<std::string>& keys);

}  // namespace sextant
