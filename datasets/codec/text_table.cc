#include "sextant/datasets/codec/text_table.h"

#include <fmt/ranges.h>

#include <algorithm>

namespace sextant {

TextTable::TextTable(TextRows& rows, std::vector<std::string> names) : rows_(rows), names_(std::move(names)) {
  if (!rows_.next()) {
    rows_.fail_here("expected a first row with the names of the columns ({}), got an empty file",
                    fmt::join(names_, " "));
  }
  n_columns_ = rows_.fields().size();
  std::vector<std::string> missing;
  for (const std::string& name : names_) {
    const auto found = std::ranges::find(rows_.fields(), std::string_view(name));
    columns_.push_back(static_cast<size_t>(found - rows_.fields().begin()));
    if (found == rows_.fields().end()) missing.push_back(name);
  }
  if (!missing.empty()) {
    rows_.fail_here("the first row names no column {}: expected {}", fmt::join(missing, ", "),
                    fmt::join(names_, " "));
  }
}

bool TextTable::next() {
  at_ = 0;
  if (!rows_.next()) return false;
  if (rows_.fields().size() != n_columns_) {
    rows_.fail_here("expected {} values, one for each column that the first row names, got {}", n_columns_,
                    rows_.fields().size());
  }
  return true;
}

size_t TextTable::step() {
  SEXTANT_CHECK(at_ < columns_.size());
  return at_++;
}

double TextTable::finite() {
  const size_t i = step();
  return rows_.finite(columns_[i], names_[i]);
}

double TextTable::metres() {
  const size_t i = step();
  return rows_.metres(columns_[i], names_[i]);
}

int TextTable::frame() { return rows_.frame(columns_[step()]); }

int TextTable::track() { return rows_.track(columns_[step()]); }

int TextTable::integer() {
  const size_t i = step();
  return rows_.integer(columns_[i], names_[i]);
}

int TextTable::not_negative() {
  const int value = integer();
  if (value < 0) rows_.fail_here("expected 0 or more for {}, got {}", names_[at_ - 1], value);
  return value;
}

bool TextTable::flag() {
  const size_t i = step();
  const std::string_view text = rows_.field(columns_[i]);
  if (text == "1" || text == "True") return true;
  if (text == "0" || text == "False") return false;
  rows_.fail_here("expected 0, 1, True or False for {}, got '{}'", names_[i], text);
}

std::string TextTable::word() { return std::string(rows_.field(columns_[step()])); }

}  // namespace sextant
