#include "sextant/eval/report/latex.h"

#include <fmt/format.h>

#include <array>
#include <regex>
#include <set>
#include <vector>

#include "sextant/base/text.h"

namespace sextant {
namespace {

constexpr size_t column_width = 6;   // columns that fit into one column of a paper
constexpr size_t small_columns = 9;  // tables with this many columns span both columns in smaller letters

constexpr std::array<LatexSign, 10> ascii_signs = {{{"\\", "\\textbackslash{}"},
                                                    {"&", "\\&"},
                                                    {"%", "\\%"},
                                                    {"$", "\\$"},
                                                    {"#", "\\#"},
                                                    {"_", "\\_"},
                                                    {"{", "\\{"},
                                                    {"}", "\\}"},
                                                    {"~", "\\textasciitilde{}"},
                                                    {"^", "\\textasciicircum{}"}}};
constexpr std::array<LatexSign, 38> unicode_signs = {
    {{"±", "$\\pm$"},     {"×", "$\\times$"},   {"·", "$\\cdot$"},  {"≤", "$\\leq$"},
     {"≥", "$\\geq$"},    {"≈", "$\\approx$"},  {"−", "$-$"},       {"–", "--"},
     {"—", "---"},        {"°", "$^{\\circ}$"}, {"²", "$^2$"},      {"³", "$^3$"},
     {"…", "\\dots{}"},   {"✓", "$\\surd$"},    {"→", "$\\to$"},    {"µ", "$\\mu$"},
     {"Δ", "$\\Delta$"},  {"Σ", "$\\Sigma$"},   {"Ω", "$\\Omega$"}, {"α", "$\\alpha$"},
     {"β", "$\\beta$"},   {"γ", "$\\gamma$"},   {"δ", "$\\delta$"}, {"ε", "$\\varepsilon$"},
     {"ζ", "$\\zeta$"},   {"η", "$\\eta$"},     {"θ", "$\\theta$"}, {"κ", "$\\kappa$"},
     {"λ", "$\\lambda$"}, {"μ", "$\\mu$"},      {"ν", "$\\nu$"},    {"ξ", "$\\xi$"},
     {"π", "$\\pi$"},     {"ρ", "$\\rho$"},     {"σ", "$\\sigma$"}, {"τ", "$\\tau$"},
     {"φ", "$\\varphi$"}, {"ω", "$\\omega$"}}};

/// Returns true for the letters À to ž (U+00C0 to U+017E) in UTF-8 that pdflatex sets as they are, in the
/// font encoding T1.
bool is_latin_letter(const std::string& sign) {
  static const std::set<std::string> unknown = {"×", "÷", "Ħ", "ħ", "ĸ", "Ŀ", "ŀ", "ŉ", "Ŧ", "ŧ"};
  return sign.size() == 2 && sign >= "\xC3\x80" && sign <= "\xC5\xBE" && !unknown.contains(sign);
}

size_t utf8_length(char first) {
  const auto byte = static_cast<unsigned char>(first);
  if (byte < 0x80U) return 1;
  return byte >= 0xF0U ? 4 : byte >= 0xE0U ? 3 : 2;
}

std::string latex_sign(const std::string& sign, std::span<const LatexSign> own) {
  using Signs = std::span<const LatexSign>;
  for (const Signs signs : {own, Signs(ascii_signs), Signs(unicode_signs)}) {
    for (const auto& [from, to] : signs)
      if (sign == from) return to;
  }
  if (sign == "<" || sign == ">") return "$" + sign + "$";
  if (sign == "|") return "\\textbar{}";
  if (sign == "\"") return "\\textquotedbl{}";
  return sign.size() == 1 || is_latin_letter(sign) ? sign : "?";
}

const char* size_command(size_t n_columns) {
  if (n_columns < small_columns) return "\\small";
  return n_columns < 13 ? "\\footnotesize\\setlength{\\tabcolsep}{3pt}"
                        : "\\tiny\\setlength{\\tabcolsep}{2pt}";
}

/// Formats "-0.012" with a minus sign instead of a hyphen, and an empty cell as a dash.
std::string latex_cell(const Cell& cell, const Column& column) {
  const std::string text = shown(cell, column);
  if (text == "-") return "--";
  if (cell.number() != nullptr && text.front() == '-') return "$-$" + text.substr(1);
  return latex_escaped(text);
}

/// Protects the first text of a row: after "\\\\" and the rules of booktabs, LaTeX would read a "[5cm]" or
/// "*" at its beginning as an argument.
std::string first_in_row(const std::string& text) {
  const bool is_argument = text.starts_with('[') || text.starts_with('*');
  return is_argument ? fmt::format("{{{}}}{}", text.substr(0, 1), text.substr(1)) : text;
}

}  // namespace

std::string latex_escaped(const std::string& text, std::span<const LatexSign> own) {
  std::string out;
  const std::string line = one_line(text);
  for (size_t i = 0; i < line.size();) {
    const size_t n = utf8_length(line[i]);
    out += latex_sign(line.substr(i, n), own);
    i += n;
  }
  // E_t, E_R, E_v and delta_d are symbols.
  static const std::regex error_symbol(R"(\bE\\_([tRv])\b)");
  static const std::regex delta_symbol(R"(\bdelta\\_d\b)");
  out = std::regex_replace(out, error_symbol, "$$E_$1$$");
  return std::regex_replace(out, delta_symbol, "$$\\delta_d$$");
}

std::string to_latex(const Table& whole, const std::string& name) {
  const auto [table, folded] = fold_columns(for_people(whole));
  const size_t n = table.columns.size();
  const char* environment = n > column_width ? "table*" : "table";
  std::string caption = latex_escaped(table.title);
  for (const std::string& part : {table.caption, folded}) {
    if (part.empty()) continue;
    const bool ends = caption.empty() || caption.ends_with('.');
    caption += (caption.empty() ? "" : ends ? " " : ". ") + latex_escaped(part);
  }
  std::string text =
      fmt::format("% \\usepackage{{booktabs, amsmath, textcomp}}\n\\begin{{{}}}\n\\centering\n", environment);
  text += fmt::format("\\caption{{{}}}\n\\label{{tab:{}}}\n{}\n", caption, name, size_command(n));
  text += "\\begin{tabular}{@{}";
  for (const Column& column : table.columns) text += column.align == Align::left ? "l" : "r";
  text += "@{}}\n\\toprule\n";
  const auto add = [&](size_t j, const std::string& cell) {
    text += j > 0 ? " & " + cell : first_in_row(cell);
  };
  for (size_t j = 0; j < n; ++j) add(j, latex_escaped(table.columns[j].title));
  text += " \\\\\n\\midrule\n";
  for (const std::vector<Cell>& row : table.rows) {
    for (size_t j = 0; j < n; ++j) add(j, latex_cell(row[j], table.columns[j]));
    text += " \\\\\n";
  }
  text += "\\bottomrule\n\\end{tabular}\n";
  for (const std::string& note : table.all_notes())
    text += fmt::format("\\par\\smallskip\\raggedright {}\n", latex_escaped(note));
  return text + fmt::format("\\end{{{}}}\n", environment);
}

}  // namespace sextant
