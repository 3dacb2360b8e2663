#include "sextant/eval/report/table.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {

namespace {

/// Header and rows as rounded text, with the width of each column.
struct Layout {
  std::vector<std::vector<std::string>> lines;
  std::vector<size_t> widths;
};

/// Frees each row as soon as it is formatted: cells and texts of a large table need not be in memory at once.
Layout lay_out(Table& table, size_t min_width) {
  Layout layout;
  layout.lines.emplace_back();
  for (const Column& column : table.columns) {
    layout.lines.back().push_back(column.title);
    layout.widths.push_back(std::max(min_width, width_of(column.title)));
  }
  layout.lines.reserve(table.rows.size() + 1);
  for (std::vector<Cell>& row : table.rows) {
    std::vector<std::string>& line = layout.lines.emplace_back();
    line.reserve(row.size());
    for (size_t i = 0; i < row.size(); ++i) {
      line.push_back(shown(row[i], table.columns[i]));
      layout.widths[i] = std::max(layout.widths[i], width_of(line.back()));
    }
    std::vector<Cell>().swap(row);
  }
  return layout;
}

/// Narrows the widest columns of text, not below their longest word, until the table fits.
void fit(const std::vector<Column>& columns, size_t width, Layout& layout) {
  constexpr size_t gap = 2;
  const size_t n = columns.size();
  size_t total = gap * (n - std::min<size_t>(n, 1));
  for (const size_t one : layout.widths) total += one;
  if (total <= width) return;
  std::vector<size_t> least = layout.widths;
  for (size_t j = 0; j < n; ++j) {
    if (columns[j].align != Align::left) continue;
    least[j] = 1;
    for (const std::vector<std::string>& line : layout.lines) {
      for (const std::string& word : split(line[j], ' ')) least[j] = std::max(least[j], width_of(word));
    }
  }
  for (; total > width; --total) {
    size_t* widest = nullptr;
    for (size_t j = 0; j < n; ++j) {
      size_t& one = layout.widths[j];
      if (one > least[j] && (widest == nullptr || one > *widest)) widest = &one;
    }
    if (widest == nullptr) return;
    --*widest;
  }
}

/// Returns the lines of one row, each text of which is broken to the width of its column.
std::vector<std::vector<std::string>> broken(const std::vector<std::string>& texts,
                                             const std::vector<size_t>& widths) {
  std::vector<std::vector<std::string>> lines(1, std::vector<std::string>(texts.size()));
  for (size_t j = 0; j < texts.size(); ++j) {
    const std::vector<std::string> parts = split(wrapped(texts[j], widths[j]), '\n');
    while (lines.size() < parts.size()) lines.emplace_back(texts.size());
    for (size_t k = 0; k < parts.size(); ++k) lines[k][j] = parts[k];
  }
  return lines;
}

void add_line(const std::vector<std::string>& texts, const std::vector<size_t>& widths,
              const std::vector<Column>& columns, std::string& out) {
  std::string line;
  for (size_t j = 0; j < texts.size(); ++j) {
    if (j > 0) line += "  ";
    line += padded(texts[j], widths[j], columns[j].align);
  }
  out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
}

std::string exact(const Cell& cell) {
  if (const std::string* text = cell.text()) return spreadsheet_field(*text);
  if (const double* number = cell.number()) return fmt::format("{}", *number);
  return "";
}

}  // namespace

std::string markdown_text(const std::string& text) {
  const std::string line = one_line(text);
  const auto letter_at = [&](size_t i) {
    return i < line.size() && std::isalpha(static_cast<unsigned char>(line[i])) != 0;
  };
  std::string out;
  for (size_t i = 0; i < line.size(); ++i) {  // escaped, because "p < 0.05" and "A & B" are not HTML
    const bool is_next = i + 1 < line.size();
    if (line[i] == '<' && (letter_at(i + 1) || (is_next && std::strchr("/!?", line[i + 1]) != nullptr))) {
      out += "&lt;";
    } else if (line[i] == '&' && (letter_at(i + 1) || (is_next && line[i + 1] == '#'))) {
      out += "&amp;";
    } else if (line[i] == '$' || (line.compare(i, 2, "](") == 0 && line.compare(i, 3, "](#") != 0)) {
      // Escapes formulas, links and pictures in untrusted text; links to places on the page are made by the
      // program.
      out += line[i] == '$' ? "&#36;" : "&#93;";
    } else {
      out += line[i];
    }
  }
  return out;
}

std::vector<Column> folded_columns(const std::vector<std::string>& keys) {
  std::vector<Column> columns;
  for (const std::string& key : keys)
    columns.push_back({.key = key, .title = key, .align = Align::left, .fold = true});
  return columns;
}

std::vector<Column> range_columns(const std::string& low_key, const std::string& high_key, int decimals,
                                  const std::string& title) {
  return {{.key = low_key, .title = "low", .decimals = decimals, .range = title},
          {.key = high_key, .title = "high", .decimals = decimals}};
}

Fields<IntervalEstimate> estimate_fields(const Column& value, const std::string& low_key,
                                         const std::string& high_key) {
  Fields<IntervalEstimate> fields = {{value, &IntervalEstimate::value}};
  return fields.add_range(range_columns(low_key, high_key, value.decimals), &IntervalEstimate::interval);
}

void Table::add_columns(std::vector<Column> more) { std::ranges::move(more, std::back_inserter(columns)); }

void Table::add_column(Column column, const std::function<Cell(size_t i)>& cell) {
  columns.push_back(std::move(column));
  for (size_t i = 0; i < rows.size(); ++i) {
    rows[i].reserve(columns.size());  // a vector by itself reserves twice as many: much in large tables
    rows[i].push_back(cell(i));
  }
}

std::optional<size_t> Table::find_column(std::string_view key) const {
  const auto column = std::ranges::find(columns, key, &Column::key);
  if (column == columns.end()) return std::nullopt;
  return static_cast<size_t>(column - columns.begin());
}

size_t Table::place(std::string_view key) const {
  const auto column = find_column(key);
  SEXTANT_CHECK(column.has_value());
  return *column;
}

std::vector<std::string> Table::all_notes() const {
  std::vector<std::string> all = notes;
  all.insert(all.end(), remarks.begin(), remarks.end());
  return all;
}

void Table::add_row(std::vector<Cell> row) {
  SEXTANT_CHECK(row.size() == columns.size());
  for (const Cell& cell : row) {
    const double* number = cell.number();
    SEXTANT_CHECK(number == nullptr || std::isfinite(*number));
  }
  rows.push_back(std::move(row));
}

namespace {

/// Returns the indices of the rows at which a part begins, and the number of rows.
std::vector<size_t> part_ends(const Table& table, const std::vector<std::string>& keys) {
  std::vector<size_t> columns;
  for (size_t j = 0; j < table.columns.size(); ++j) {
    if (std::ranges::find(keys, table.columns[j].key) != keys.end()) columns.push_back(j);
  }
  std::vector<size_t> ends;
  for (size_t i = 0; i < table.rows.size(); ++i) {
    const bool continues = i > 0 && std::ranges::all_of(columns, [&](size_t j) {
                             return table.rows[i - 1][j] == table.rows[i][j];
                           });
    if (!continues) ends.push_back(i);
  }
  ends.push_back(table.rows.size());
  return ends;
}

}  // namespace

size_t n_parts(const Table& table, const std::vector<std::string>& keys) {
  return keys.empty() ? 1 : part_ends(table, keys).size() - 1;
}

void for_each_part(const Table& table, const std::vector<std::string>& keys,
                   const std::function<void(const Table& part)>& do_part) {
  const std::vector<size_t> ends = part_ends(table, keys);
  if (keys.empty() || ends.size() == 2) return do_part(table);
  const auto at = [&](size_t i) { return table.rows.begin() + static_cast<std::ptrdiff_t>(i); };
  for (size_t i = 0; i + 1 < ends.size(); ++i)
    do_part({table.title,
             table.caption,
             table.columns,
             {at(ends[i]), at(ends[i + 1])},
             table.notes,
             table.remarks});
}

std::string to_text(const Table& whole, size_t width) {
  auto [table, folded] = fold_columns(for_people(whole));
  Layout layout = lay_out(table, 1);
  if (width > 0) fit(table.columns, width, layout);
  std::string text;
  if (!table.title.empty()) text += page_text(table.title) + "\n";
  if (!table.caption.empty()) text += page_text(table.caption) + "\n";
  if (!folded.empty()) text += folded + "\n";
  if (!text.empty()) text += "\n";
  for (size_t i = 0; i < layout.lines.size(); ++i) {
    if (width == 0) {
      add_line(layout.lines[i], layout.widths, table.columns, text);
    } else {
      for (const auto& line : broken(layout.lines[i], layout.widths))
        add_line(line, layout.widths, table.columns, text);
    }
    if (i > 0) continue;
    for (size_t j = 0; j < layout.widths.size(); ++j)
      text.append(j > 0 ? 2 : 0, ' ').append(layout.widths[j], '-');
    text += "\n";
  }
  const std::vector<std::string> notes = table.all_notes();
  if (!notes.empty()) text += "\n";
  for (const std::string& note : notes) text += page_text(note) + "\n";
  return text;
}

std::string to_markdown(const Table& whole) {
  Table table = for_people(whole);
  Layout layout = lay_out(table, 3);
  std::string text;
  if (!table.title.empty()) text += fmt::format("## {}\n\n", markdown_text(table.title));
  if (!table.caption.empty()) text += markdown_text(table.caption) + "\n\n";
  const size_t rows_begin = text.size();
  for (size_t i = 0; i < layout.lines.size(); ++i) {
    for (size_t j = 0; j < table.columns.size(); ++j) {
      const std::string cell = replaced(markdown_text(layout.lines[i][j]), "|", "\\|");
      text += fmt::format("| {} ", padded(cell, layout.widths[j], table.columns[j].align));
    }
    text += "|\n";
    std::vector<std::string>().swap(layout.lines[i]);
    if (i > 0) continue;
    text.reserve(rows_begin + (text.size() - rows_begin) * (layout.lines.size() + 1));
    for (size_t j = 0; j < layout.widths.size(); ++j) {
      const std::string rule(layout.widths[j] - 1, '-');
      text += fmt::format(fmt::runtime(table.columns[j].align == Align::left ? "| :{} " : "| {}: "), rule);
    }
    text += "|\n";
  }
  for (const std::string& note : table.all_notes()) text += fmt::format("\n{}\n", markdown_text(note));
  return text;
}

std::string to_csv(const Table& table) {
  std::string text;
  for (size_t j = 0; j < table.columns.size(); ++j)
    text.append(j > 0 ? 1 : 0, ',').append(spreadsheet_field(table.columns[j].key));
  text += "\n";
  for (const std::vector<Cell>& row : table.rows) {
    for (size_t j = 0; j < row.size(); ++j) text.append(j > 0 ? 1 : 0, ',').append(exact(row[j]));
    text += "\n";
  }
  return text;
}

namespace {

Json row_to_json(const Table& table, const std::vector<Cell>& row) {
  Json object = Json::object();
  for (size_t j = 0; j < row.size(); ++j) {
    const std::string& key = table.columns[j].key;
    if (const std::string* text = row[j].text()) object[key] = *text;
    if (const double* number = row[j].number()) object[key] = *number;
  }
  return object;
}

}  // namespace

Json rows_to_json(const Table& table) {
  Json rows = Json::array();
  for (const std::vector<Cell>& row : table.rows) rows.push_back(row_to_json(table, row));
  return rows;
}

std::string rows_to_json_text(const Table& table) {
  if (table.rows.empty()) return "[]\n";
  std::string text = "[";
  for (const std::vector<Cell>& row : table.rows) {
    text += text.size() > 1 ? ",\n  " : "\n  ";
    std::string object = json_text(row_to_json(table, row));
    object.pop_back();  // the end of the line
    for (const char c : object) {
      text += c;
      if (c == '\n') text += "  ";
    }
    if (&row == &table.rows.front()) text.reserve(text.size() * (table.rows.size() + 1));
  }
  text += "\n]\n";
  return text;
}

namespace {

/// Returns the columns for which `keeps(column index)` is true.
template <typename Predicate>
Table only_columns(const Table& whole, const Predicate& keeps) {
  std::vector<size_t> kept;
  for (size_t j = 0; j < whole.columns.size(); ++j)
    if (keeps(j)) kept.push_back(j);
  Table table{whole.title, whole.caption, {}, {}, whole.notes, whole.remarks};
  for (const size_t j : kept) table.columns.push_back(whole.columns[j]);
  table.rows.reserve(whole.rows.size());
  for (const std::vector<Cell>& row : whole.rows) {
    std::vector<Cell>& cells = table.rows.emplace_back();
    cells.reserve(kept.size());
    for (const size_t j : kept) cells.push_back(row[j]);
  }
  return table;
}

/// Joins the columns j and j + 1 into one column of text.
void join_range(Table& table, size_t j) {
  const Column low = table.columns[j];
  const Column high = table.columns[j + 1];
  for (std::vector<Cell>& row : table.rows) {
    const bool is_empty = row[j].is_empty() && row[j + 1].is_empty();
    row[j] = is_empty ? Cell() : Cell(fmt::format("[{}, {}]", shown(row[j], low), shown(row[j + 1], high)));
    row.erase(row.begin() + static_cast<std::ptrdiff_t>(j) + 1);
  }
  table.columns[j].title = low.range;
  table.columns.erase(table.columns.begin() + static_cast<std::ptrdiff_t>(j) + 1);
}

/// Formats 0.000178, 0.0886, -51.2, 195, 2431: with `digits` significant digits, but never without the digits
/// before the decimal point.
std::string rounded_to_digits(double number, int digits) {
  constexpr double rounding = 1e-5;  // differences of equal numbers, in any unit of the claims
  const double size = std::abs(number);
  if (size < rounding) return "0";
  const int before = static_cast<int>(std::floor(std::log10(size))) + 1;
  return fmt::format("{:.{}f}", number, std::max(0, digits - before));
}

}  // namespace

std::string shown(const Cell& cell, const Column& column) {
  if (const std::string* text = cell.text()) return text->empty() ? "-" : one_line(*text);
  const double* number = cell.number();
  if (number == nullptr) return "-";
  if (column.significant > 0) return rounded_to_digits(*number, column.significant);
  const double half_unit = 0.5 * std::pow(10.0, -column.decimals);
  if (column.below && *number > 0 && *number < half_unit) {
    return fmt::format("<{:.{}f}", 2 * half_unit, column.decimals);
  }
  const bool is_zero = std::abs(*number) < half_unit;  // avoids "-0.000"
  return fmt::format("{:.{}f}", is_zero ? 0.0 : *number, column.decimals);
}

Table for_people(const Table& whole) {
  Table table = only_columns(whole, [&](size_t j) { return !whole.columns[j].detail; });
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
  std::string shared_values;
  for (size_t j = 0; j < table.columns.size(); ++j) {
    const Cell& cell = table.rows.front()[j];
    if (!folds(j) || shown(cell, table.columns[j]) == "-") continue;
    if (!shared_values.empty()) shared_values += ", ";
    if (!table.columns[j].names_its_quantity) shared_values += table.columns[j].title + " ";
    shared_values += shown(cell, table.columns[j]);
  }
  return {only_columns(table, [&](size_t j) { return !folds(j); }), shared_values};
}

size_t width_of(const std::string& text) {
  const auto begins_character = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; };
  return static_cast<size_t>(std::ranges::count_if(text, begins_character));
}

std::string padded(const std::string& text, size_t width, Align align) {
  const std::string space(width - std::min(width, width_of(text)), ' ');
  return align == Align::left ? text + space : space + text;
}

std::string wrapped(const std::string& text, size_t width, const std::string& indent) {
  std::string out;
  size_t at = 0;  // characters in the current line
  for (const std::string& line : split(text, '\n')) {
    if (!out.empty()) out += '\n';
    at = 0;
    for (const std::string& word : split(line, ' ')) {
      const size_t length = width_of(word);
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

Table with_distinct(Table table, const std::vector<std::string>& keys) {
  std::set<double> numbers = {0.0};
  std::vector<size_t> places;
  int decimals = 0;
  for (const std::string& key : keys) {
    const auto place = table.find_column(key);
    if (!place) continue;
    places.push_back(*place);
    decimals = std::max(decimals, table.columns[*place].decimals);
    for (const std::vector<Cell>& row : table.rows) {
      if (const double* number = row[*place].number()) numbers.insert(*number);
    }
  }
  const auto look_alike = [&] {
    std::set<std::string> texts;
    for (const double number : numbers) texts.insert(shown(number, Column::number("", decimals)));
    return texts.size() < numbers.size();
  };
  if (!look_alike()) return table;
  while (decimals < 12 && look_alike()) ++decimals;
  for (const size_t place : places) table.columns[place].decimals = decimals;
  return table;
}

Table with_columns(const Table& table, const std::vector<std::string>& keys) {
  return only_columns(table,
                      [&](size_t j) { return std::ranges::find(keys, table.columns[j].key) != keys.end(); });
}

}  // namespace sextant
