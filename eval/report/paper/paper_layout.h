#pragma once

// Tables I to V as the paper prints them, filled from the rows of the long tables (eval/report/tables).
// results/published/zhang2020_layout.json declares header, rows, columns, digits and what fills a cell; no
// table, data set or estimator is named in code.
//
//   version   the table filled by one procedure from one kind of data. The first takes the procedure
//             nearest to the paper and, cell by cell, the nearest data at hand
//   verdict   within, outside: the published value lies among our single runs (tables/published_rows.h), or
//             does not; with the data in words where they are not the paper's ("outside, on a scenario").
//             "not comparable" where the paper counted something else; "not measured here"; "" where the
//             paper has no value
//   rate      of a count: of how many it is ("21 % of static by truth"). Its verdict compares rates: the
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
  std::string name;  ///< the row's name; of "Dynamic/Static" one of the two words
  std::optional<double> published{};
  std::optional<Measured> measured{};
  std::string verdict{};
  std::string reason{};  ///< of "not comparable"
  std::optional<double> rate{}, published_rate{};
  std::string rate_of{};  ///< quantity; empty where counts are no rates
  std::string estimator{}, data{}, dataset{}, records{};
  double factor = 1;                          ///< by which the long table's value is multiplied
  bool best = false, best_published = false;  ///< least of the columns that the paper compares
};

using LayoutCell = std::vector<LayoutValue>;

struct LayoutRow {
  std::string name;                 ///< unique in the table: sequence, frames and body as the paper writes them
  std::vector<std::string> labels;  ///< one a label column of the header
  int decimals = 0;
  std::vector<LayoutCell> cells;  ///< one a column; empty: the row has none there
  bool is_ours = false;           ///< stands below a rule: the paper does not have it
  bool in_terminal = true;
};

struct LayoutVersion {
  std::string procedure, data{};  ///< in words
  std::vector<LayoutRow> rows{};
  std::vector<std::string> notes{};  ///< distinct: why something is not comparable, what rows of ours are
  size_t n_measured = 0;             ///< cells of the paper's rows
  bool is_incomplete = false;        ///< some value of the paper was not measured
};

struct HeaderGroup {
  std::string text;
  size_t span = 1;
};

struct PaperLayout {
  std::string name;       ///< "table_3": stem of its files
  std::string number;     ///< "III"
  std::string title;      ///< as the paper prints it
  std::string missing{};  ///< what would measure what was not measured
  std::vector<std::vector<HeaderGroup>> header{};
  std::vector<std::string> columns{};  ///< unique names: "Joint E_t (m)"
  std::vector<LayoutVersion> versions{};

  /// One sentence: what is shown.
  std::string sentence(const LayoutVersion& version) const;

  /// Notes of a version, and the command that measures what it lacks.
  std::vector<std::string> notes_of(const LayoutVersion& version) const;
};

/// The five tables, in the order of their numbers. `tables`: the long ones, by number.
std::vector<PaperLayout> paper_layouts(std::span<const PublishedTable> tables);

/// The rank of a data set among the kinds of data, 0 for the paper's own; the last for one that is of no
/// kind.
size_t data_nearness(const std::string& dataset);

/// The value with at least the row's decimals, and with those of the long table where it is no whole
/// number.
std::string layout_number(double value, int decimals);

}  // namespace sextant
