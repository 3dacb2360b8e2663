#pragma once

// A table with several renderings: aligned text, Markdown, CSV and JSON are made from the same object, so
// they cannot disagree. Text and Markdown round to the decimals of each column; CSV and JSON keep every
// digit. A cell without a value is "-" in text and Markdown, empty in CSV and left out in JSON, never 0.

#include <concepts>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "sextant/base/interned.h"
#include "sextant/base/options.h"
#include "sextant/stats/bootstrap.h"

namespace sextant {

enum class Align { left, right };

/// A column: name, title and format.
struct Column {
  std::string key;    ///< machine name, with unit suffix: CSV header and JSON key
  std::string title;  ///< title for readers, with unit: "E_t [m]"
  Align align = Align::right;
  int decimals = 3;  ///< decimals of numbers in text and Markdown
  /// In renderings for readers, state the value once above the table instead of in a column, if all rows
  /// agree; an empty value is not stated.
  bool fold = false;
  bool detail = false;  ///< only in CSV and JSON
  /// Text and Markdown: show "<0.0001" for a positive number that rounds to 0, as for p-values.
  bool below = false;
  /// If not empty: for readers this and the next column form one column "[low, high]" with this title.
  std::string range{};
  bool names_its_quantity = false;  ///< `fold` states the value without the title
  /// If above 0: for readers, number of significant digits instead of `decimals`; values below 1e-5 are
  /// rounding and are shown as 0.
  int significant = 0;
  /// If not empty: on pages the cell links to the address in the column of this key.
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
  Column with_significant(int digits) const {
    Column column = *this;
    column.significant = digits;
    return column;
  }
  /// Makes the cell link, on pages, to the address in the column of that key.
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

/// Returns text columns, titled by their keys, whose value is stated once if all rows agree.
std::vector<Column> folded_columns(const std::vector<std::string>& keys);
/// Returns two columns for the ends of an interval, which readers see as one column "[low, high]".
std::vector<Column> range_columns(const std::string& low_key, const std::string& high_key, int decimals,
                                  const std::string& title = "95 % interval");

/// A text that has the size of a pointer: most cells of a large table are numbers or empty, and a std::string
/// in each would double the memory of the table.
class CellText {
 public:
  CellText(std::string text) : text_(std::make_unique<const std::string>(std::move(text))) {}
  CellText(const CellText& other) : CellText(*other.text_) {}
  CellText(CellText&& other) noexcept = default;
  CellText& operator=(CellText other) noexcept {
    text_ = std::move(other.text_);
    return *this;
  }
  const std::string& str() const { return *text_; }
  bool operator==(const CellText& other) const { return *text_ == *other.text_; }

 private:
  std::unique_ptr<const std::string> text_;
};

/// Empty, a text, or a finite number.
class Cell : std::variant<std::monostate, CellText, double> {
 public:
  Cell() = default;
  Cell(std::string text) : variant(CellText(std::move(text))) {}
  Cell(const char* text) : Cell(std::string(text)) {}
  Cell(std::string_view text) : Cell(std::string(text)) {}
  Cell(Interned text) : Cell(text.str()) {}
  Cell(double number) : variant(number) {}
  Cell(std::integral auto number) : variant(static_cast<double>(number)) {}
  template <typename T>
  Cell(const std::optional<T>& value) : Cell(value ? Cell(*value) : Cell()) {}

  bool is_empty() const { return index() == 0; }
  /// Returns null unless the cell is a text.
  const std::string* text() const {
    const auto* text = std::get_if<CellText>(this);
    return text == nullptr ? nullptr : &text->str();
  }
  /// Returns null unless the cell is a number.
  const double* number() const { return std::get_if<double>(this); }
  bool operator==(const Cell& other) const = default;
};

struct Table {
  std::string title;
  std::string caption{};  ///< one paragraph: preset, aggregate, units; below the title
  std::vector<Column> columns{};
  std::vector<std::vector<Cell>> rows{};  ///< each as long as `columns`
  std::vector<std::string> notes{};       ///< below the table, one line each
  std::vector<std::string> remarks{};     ///< further notes, for specialists; pages fold them

  /// Returns the notes followed by the remarks.
  std::vector<std::string> all_notes() const;
  void add_columns(std::vector<Column> more);
  /// Adds a column with cell(i) in row i.
  void add_column(Column column, const std::function<Cell(size_t i)>& cell);
  /// Returns the index of the column with that key; nullopt if there is none.
  std::optional<size_t> find_column(std::string_view key) const;
  /// Returns the index of the column with that key; throws InternalError if there is none.
  size_t place(std::string_view key) const;
  /// Adds a row. Throws InternalError if its length is wrong or a number is not finite.
  void add_row(std::vector<Cell> row);
};

/// A column, and the function that computes its cell from a row, a plain struct.
template <typename Row>
struct Field {
  Column column;
  std::function<Cell(const Row&)> of;  ///< a member, or a function of the row
};

/// The columns of a table of `Row`, in order, each declared once with the function of its cells.
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
  /// Adds the columns of a part of the row, such as a member. `find` returns a pointer to this part, or an
  /// optional; if the part is absent, its cells are empty.
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
  /// Adds the two ends of the interval that `find` returns as an optional. `ends` are usually
  /// range_columns().
  template <typename Find>
  Fields& add_range(const std::vector<Column>& ends, const Find& find) {
    return add(Fields<Interval>{{ends.at(0), &Interval::low}, {ends.at(1), &Interval::high}}, find);
  }
};

/// Returns the columns of an estimate: its value, and the two ends of its 95 % interval.
Fields<IntervalEstimate> estimate_fields(const Column& value, const std::string& low_key,
                                         const std::string& high_key);

/// Return the cell of an end of an interval; empty if there is no interval.
inline Cell low_of(const std::optional<Interval>& interval) {
  return interval ? Cell(interval->low) : Cell();
}
inline Cell high_of(const std::optional<Interval>& interval) {
  return interval ? Cell(interval->high) : Cell();
}

/// Makes a table with one row for each of `rows`, which are rows or pointers to rows.
template <typename Row, typename Item>
Table table_of(std::string title, std::string caption, const Fields<Row>& fields,
               const std::vector<Item>& rows) {
  Table table{std::move(title), std::move(caption)};
  for (const Field<Row>& field : fields) table.columns.push_back(field.column);
  for (const Item& item : rows) {
    std::vector<Cell> cells;
    for (const Field<Row>& field : fields) {
      if constexpr (std::is_pointer_v<Item>)
        cells.push_back(field.of(*item));
      else
        cells.push_back(field.of(item));
    }
    table.add_row(std::move(cells));
  }
  return table;
}

/// Calls do_part(part) for each part of a table, which is split at each change of the values in these
/// columns; without keys the whole table is the only part. Columns marked `fold` state a value that the rows
/// of a part share once. A part exists during the call only.
void for_each_part(const Table& table, const std::vector<std::string>& keys,
                   const std::function<void(const Table& part)>& do_part);
/// Returns the number of these parts; 0 if the table has keys and no rows.
size_t n_parts(const Table& table, const std::vector<std::string>& keys);

/// Raises the decimals of these columns, together, to the fewest with which readers see no two different
/// numbers in them as equal, and no number above 0 as 0; at most 12.
Table with_distinct(Table table, const std::vector<std::string>& keys);

/// Formats a table in aligned columns. If it is wider than `width` characters (0: any width fits), texts of
/// its widest columns are broken at blanks into several lines, as far as the words permit.
std::string to_text(const Table& table, size_t width = 0);
std::string to_markdown(const Table& table);
/// Escapes an untrusted text as one line of Markdown without HTML.
std::string markdown_text(const std::string& text);
/// Returns CSV (RFC 4180) with a header line of column keys; title, caption and notes are not written.
std::string to_csv(const Table& table);
/// Returns an array with one object per row; empty cells are left out.
Json rows_to_json(const Table& table);
/// Returns the text of rows_to_json(), made row by row, because the JSON object of all rows takes ten times
/// the memory of its text.
std::string rows_to_json_text(const Table& table);

// ---- Common parts of the renderings for readers (text, Markdown, LaTeX, HTML).

/// Formats a cell with the decimals or significant digits of its column; "-" for an empty cell.
std::string shown(const Cell& cell, const Column& column);

/// Removes detail columns and joins the two columns of a range.
Table for_people(const Table& table);

struct FoldedTable {
  Table table;
  std::string shared_values;  ///< the values of the removed columns: "dataset vdo, sequence 0003"
};
/// Removes the columns marked `fold` whose value is the same in every row.
FoldedTable fold_columns(const Table& table);

/// Returns the number of characters of a UTF-8 text.
size_t width_of(const std::string& text);
/// Adds blanks to a text of fewer than `width` characters.
std::string padded(const std::string& text, size_t width, Align align);

/// Breaks a text at blanks into lines of at most `width` characters if the words permit; later lines begin
/// with `indent`.
std::string wrapped(const std::string& text, size_t width, const std::string& indent = "");

/// Keeps only the columns with these keys, in the table's order.
Table with_columns(const Table& table, const std::vector<std::string>& keys);

}  // namespace sextant
