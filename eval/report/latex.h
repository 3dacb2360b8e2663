#pragma once

// A table as LaTeX: \begin{table} with booktabs' rules, caption, label and notes, in a font size that fits
// its columns. Needs \usepackage{booktabs, amsmath, textcomp} and \usepackage[utf8]{inputenc} with pdflatex.
// Columns with the same value in every row are stated once in the caption; details are left out, as in
// to_text.

#include <string>

#include "sextant/eval/report/table.h"

namespace sextant {

/// `name` gives the label "tab:<name>".
std::string to_latex(const Table& table, const std::string& name);

/// Escapes special characters; formats E_t, E_R, E_v as symbols, and Greek letters and signs outside ASCII as
/// commands. An unknown character becomes "?".
std::string latex_escaped(const std::string& text);

}  // namespace sextant
