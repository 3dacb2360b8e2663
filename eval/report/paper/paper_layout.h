#pragma once

// Tables I to V as the paper prints them, filled from the rows of the long tables (eval/report/tables).
// results/published/zhang2020_layout.json declares header, rows, columns, digits and the values of a cell;
// the code names no table, data set or estimator.
//
//   version   the table filled by one procedure and one kind of data. The first version takes the procedure
//             nearest to the paper and, for each cell, the nearest available data
//   verdict   within, outside: the published value lies in the range of our single runs
//             (tables/published_rows.h), or not. Data that differ from the paper's are named ("outside, on a
//             scenario"). "not comparable" if the paper counted a different quantity; "not measured here"; ""
//             if the paper has no value
//   rate      share that a count represents ("21 % of static by truth"). Its verdict compares rates: the
//             range of single runs over the mean number, widened to the binomial (Wilson) 95 % interval of
//             one run

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {

/// One number of a cell.
struct LayoutValue {
  std::string name;  ///< name of the row; for "Dynamic/Static" one of the two words
  std::optional<double> published{};
  std::optional<Measured> measured{};
  std::string verdict{};
  std::string reason{};  ///< reason of "not comparable"
  std::optional<double> rate{}, published_rate{};
  std::string rate_of{};  ///< quantity that the rate refers to; empty if the counts are not rates
  std::string estimator{}, data{}, dataset{}, records{};
  double factor = 1;                          ///< factor applied to the value of the long table
  bool best = false, best_published = false;  ///< smallest value of the columns that the paper compares
};

using LayoutCell = std::vector<LayoutValue>;

/// A row of the printed table.
struct LayoutRow {
  std::string name;  ///< unique in the table: sequence, frames and body in the paper's notation
  std::vector<std::string> labels;  ///< one per label column of the header
  int decimals = 0;
  std::vector<LayoutCell> cells;  ///< one per column; empty: no value in this column
  bool is_ours = false;           ///< below a rule: a row that the paper does not have
  bool in_terminal = true;
};

/// One version of a table: the rows filled by one procedure and one kind of data.
struct LayoutVersion {
  std::string procedure, data{};  ///< names for readers
  std::vector<LayoutRow> rows{};
  /// Distinct notes: reasons why values are not comparable, and explanations of our own rows
  std::vector<std::string> notes{};
  size_t n_measured = 0;       ///< measured cells in the rows of the paper
  bool is_incomplete = false;  ///< true if a value of the paper was not measured
};

struct HeaderGroup {
  std::string text;
  size_t span = 1;
};

/// A printed table with all its versions.
struct PaperLayout {
  std::string name;       ///< "table_3": stem of its files
  std::string number;     ///< "III"
  std::string title;      ///< title in the paper
  std::string missing{};  ///< command that would measure the missing values
  std::vector<std::vector<HeaderGroup>> header{};
  std::vector<std::string> columns{};  ///< unique names: "Joint E_t (m)"
  std::vector<LayoutVersion> versions{};

  /// Describes in one sentence what the version shows.
  std::string sentence(const LayoutVersion& version) const;

  /// Notes of a version, and the command that measures what it lacks.
  std::vector<std::string> notes_of(const LayoutVersion& version) const;
};

/// Makes the five tables in the order of their numbers from the long tables, which are found by number.
std::vector<PaperLayout> paper_layouts(std::span<const PublishedTable> tables);

/// Rank of a data set among the kinds of data: 0 for the paper's own, the last rank if it is of no kind.
size_t data_nearness(const std::string& dataset);

/// Formats a value with the decimals of its row, or with one decimal if the row has none and the value is not
/// a whole number.
std::string layout_number(double value, int decimals);

}  // namespace sextant
