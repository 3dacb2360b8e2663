#pragma once

// Text files whose first row names the columns. Columns are found by name, so that their order and further
// columns do not matter. All messages start "NAME:LINE: ".
//
//   TextRows rows(bytes, path);
//   for (TextTable table(rows, {"frame", "speed"}); table.next();) {
//     series.emplace(table.integer(), table.finite());  // in the order of the names above
//   }

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/datasets/codec/text_rows.h"

namespace sextant {

class TextTable {
 public:
  /// Reads the header. Throws Error when the file is empty, or lacks columns (it names every missing one).
  /// `rows` must outlive the table.
  TextTable(TextRows& rows, std::vector<std::string> names);

  /// Steps to the next row; false at the end. Throws Error unless it has as many fields as the header.
  bool next();

  // The fields of the row in the order of `names`, one a call.
  double finite();
  int integer();
  double metres();     ///< as TextRows::metres
  int not_negative();  ///< integer >= 0
  int frame();         ///< as TextRows::frame
  int track();         ///< as TextRows::track
  bool flag();         ///< 0, 1, True, False
  std::string word();

  // The header and the row itself, for fields that go by position.
  size_t n_columns() const { return n_columns_; }
  size_t column(size_t i) const { return columns_[i]; }  ///< where the i-th of `names` stands
  const TextRows& rows() const { return rows_; }

 private:
  size_t step();

  TextRows& rows_;
  std::vector<std::string> names_;
  std::vector<size_t> columns_;  // of names_
  size_t n_columns_ = 0;
  size_t at_ = 0;
};

}  // namespace sextant
