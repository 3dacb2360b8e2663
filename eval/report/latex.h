#pragma once

// A table as LaTeX: \begin{table} with booktabs' rules, caption, label and notes below, in the size of
// letters that its columns leave. Needs \usepackage{booktabs, amsmath, textcomp} and
// \usepackage[utf8]{inputenc}, under pdflatex. Columns that say the same in every row are said once in the
// caption, details are left out, as in to_text.

#include <string>

#include "sextant/eval/report/table.h"

namespace sextant {

/// `name` becomes the label: "tab:<name>".
std::string to_latex(const Table& table, const std::string& name);

/// Special characters escaped; E_t, E_R, E_v as symbols; Greek letters and signs outside ASCII as commands. A
/// character it does not know becomes "?".
std::string latex_escaped(const std::string& text);

}  // namespace sextant
