#pragma once

// A table as LaTeX: \begin{table} with booktabs' rules, caption, label and notes, in a font size that fits
// its columns. Needs \usepackage{booktabs, amsmath, textcomp}, \usepackage[utf8]{inputenc} and, for letters
// with accents, \usepackage[T1]{fontenc} with pdflatex. Columns with the same value in every row are stated
// once in the caption; details are left out, as in to_text.

#include <span>
#include <string>
#include <utility>

#include "sextant/eval/report/table.h"

namespace sextant {

/// Returns the table as LaTeX, with the label "tab:<name>".
std::string to_latex(const Table& table, const std::string& name);

/// A character, and what stands for it in LaTeX.
using LatexSign = std::pair<const char*, const char*>;
/// Escapes special characters; formats E_t, E_R, E_v as symbols, and Greek letters and signs outside ASCII as
/// commands; keeps Latin letters. An unknown character becomes "?". The signs in `own` have priority.
std::string latex_escaped(const std::string& text, std::span<const LatexSign> own = {});

}  // namespace sextant
