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

#include "sextant/base/json.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/latex.h"
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
  bool is_added = false;          ///< below a rule: a row that the paper does not have
  std::string quantity{};         ///< name of the row in the paper, which an added row repeats for a system
  std::string system{};           ///< title of that system; empty in rows of the paper
  bool in_terminal = true;
};

/// One version of a table: the rows filled by one procedure and one kind of data.
struct LayoutVersion {
  std::string procedure, data{};  ///< names for readers
  std::vector<LayoutRow> rows{};
  /// Distinct notes: reasons why values are not comparable, and explanations of our own rows
  std::vector<std::string> notes{};
  std::string note_on_folded_rows{};  ///< explains rows that a terminal does not show
  size_t n_measured = 0;              ///< measured cells in the rows of the paper
  bool is_incomplete = false;         ///< true if a value of the paper was not measured
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

// ---- The cells for readers.
//
//   ✓ within   ✗ outside   ≠ not comparable   ? undecided   – not measured here

/// Returns the sign of a verdict; empty if there is none.
std::string verdict_sign(const std::string& verdict);
inline constexpr const char* verdict_signs =
    "\u2713 within, \u2717 outside our single runs; \u2260 not comparable; ? undecided; \u2013 not "
    "measured here";

/// Return the numbers of a cell, joined by "/": ours with the sign of the verdict, and the published ones in
/// parentheses. "" if a number of the cell is missing; if only ours are missing, cell_measured() returns a
/// dash.
std::string cell_measured(const LayoutRow& row, const LayoutCell& cell);
std::string cell_published(const LayoutRow& row, const LayoutCell& cell);
/// Lists everything that is known about the numbers of a cell, one sentence each.
std::string cell_details(const LayoutVersion& version, const LayoutCell& cell);

// ---- The tables as text for a terminal, Markdown, LaTeX, CSV and JSON (renderings.cc). Text, Markdown and
// LaTeX round to the paper's digits; CSV and JSON keep every digit. All use the same description, so they
// cannot disagree.

/// Formats text of at most 100 columns if the labels permit. With `all` it has every version and row;
/// otherwise only the first version, without the rows whose `in_terminal` is false.
std::string to_text(const PaperLayout& layout, bool all);
/// Returns the lines below the tables that explain parentheses and signs.
std::string text_legend();
std::string to_markdown(const PaperLayout& layout);
/// Returns a complete LaTeX document; comments enclose the part to paste into a paper.
std::string to_latex(const PaperLayout& layout);
/// Returns CSV with one line per number.
std::string to_csv(const PaperLayout& layout);
/// Returns {"rows": {row name: {column name: {"published", "measured", "verdict", ...}}}} of the first
/// version; the other versions are in "versions". A cell with two numbers contains one object for each.
Json to_json(const PaperLayout& layout);

// ---- The tables as HTML (paper_page.cc): a fragment for the page of the reproduction, and
// paper.html with all tables and figures in the paper's order for printing on A4.

/// Returns the tables with style and script. The fragment contains every version of a table; the script shows
/// one at a time.
Fragment paper_fragment(const std::vector<PaperLayout>& layouts);

/// A figure of the printed version, with the paper's number.
struct PrintedFigure {
  PaperPlace place;
  std::string caption;
  std::string name;  ///< name of a Figure; its SVG is figures/<name>.svg in `drawn`
  double width_cm = 0;
};
/// Makes paper.html. `answer` is its first paragraph. Throws InternalError if a figure is not in `drawn`.
std::string paper_page(const std::string& title, const std::string& answer,
                       const std::vector<PaperLayout>& layouts, const std::vector<PrintedFigure>& figures,
                       const OutputFiles& drawn);

/// Makes paper/table_1.txt, .md, .tex, .csv, .json, ... for a report folder.
OutputFiles paper_files(const std::vector<PaperLayout>& layouts);

}  // namespace sextant
