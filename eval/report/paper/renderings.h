#pragma once

// The tables of the paper (paper_layout.h) as text for a terminal, Markdown, LaTeX, CSV and JSON. Text,
// Markdown and LaTeX round to the paper's digits; CSV and JSON keep every digit. All use the same
// description, so they cannot disagree.
//
//   ✓ within   ✗ outside   ≠ not comparable   ? undecided   – not measured here

#include <string>

#include "sextant/base/json.h"
#include "sextant/eval/report/paper/paper_layout.h"

namespace sextant {

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

}  // namespace sextant
