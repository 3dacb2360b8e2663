#include "sextant/eval/report/latex.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/eval/report/testing.h"

namespace sextant {
namespace {

using testing::HasSubstr;

Table table_of(int n_numbers) {
  Table table{"50 % of $E_t$ & \"more\" #1",
              "Low {and} high ~ 95^2 % < x > y \\ δ_d ≤ 0.2 px ± 1 — 日 | delta_d",
              {Column::text("set").folded(), Column::text("body_name")}};
  for (int j = 0; j < n_numbers; ++j) table.columns.push_back({fmt::format("e{}_m", j), "E_t [m]"});
  for (const char* body : {"ego", "object:1"}) {
    std::vector<Cell> row = {"S18-F124_134", body};
    row.emplace_back();
    for (int j = 1; j < n_numbers; ++j) row.emplace_back(-0.1 * j);
    table.add_row(row);
  }
  table.notes = {"50 % & more_of _this"};
  return table;
}

/// A table with labels that LaTeX would read as the optional argument or the star of "\\\\".
Table labels_table() {
  Table table{.title = "Labels of Müller, Łódź", .columns = {Column::text("label"), Column::text("other")}};
  for (const char* label : {"[5cm]", "[p] x", "*", "x"}) table.add_row({label, "a"});
  return table;
}

TEST(Latex, EscapesFoldsAndSetsNumbers) {
  const std::string text = to_latex(table_of(2), "flow_err");
  for (const char* part :
       {"50 \\% of \\$$E_t$\\$ \\& \\textquotedbl{}more\\textquotedbl{} \\#1. Low \\{and\\}",
        "$\\leq$ 0.2 px $\\pm$ 1", "\\begin{table}\n", "set S18-F124\\_134}",
        "body\\_name & $E_t$ [m] & $E_t$ [m] \\\\\n", "ego & -- & $-$0.100 \\\\\n", "\\label{tab:flow_err}"})
    EXPECT_THAT(text, HasSubstr(part));
  EXPECT_EQ(latex_escaped("Müller é Łódź λ 2 µ"), "Müller é Łódź $\\lambda$ 2 $\\mu$");
  EXPECT_THAT(to_latex(table_of(8), "wide"), HasSubstr("\\begin{table*}\n\\centering\n"));
}

TEST(Latex, TheFirstCellOfARowIsNoArgumentOfTheLineBreak) {
  const std::string text = to_latex(labels_table(), "labels");
  for (const char* row : {"\\midrule\n{[}5cm] & a \\\\\n", "{[}p] x & a", "{*} & a", "\nx & a"})
    EXPECT_THAT(text, HasSubstr(row));
}

TEST(Latex, CompilesUnderPdflatex) {
  std::string body = to_latex(labels_table(), "labels");
  for (const int n : {1, 8, 20}) body += to_latex(table_of(n), fmt::format("t{}", n));
  const std::optional<Compiled> page = compile_latex(body);
  if (!page) GTEST_SKIP() << no_pdflatex;
  EXPECT_TRUE(page->ok) << page->words;
  EXPECT_THAT(page->words, testing::Not(HasSubstr("undefined")));
}

}  // namespace
}  // namespace sextant
