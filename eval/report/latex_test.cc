#include "sextant/eval/report/latex.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "sextant/base/files.h"

namespace sextant {
namespace {

using testing::HasSubstr;

Table table_of(int n_numbers) {
  Table table;
  table.title = "50 % of $E_t$ & \"more\" #1";
  table.caption = "Low {and} high ~ 95^2 % < x > y \\ δ_d ≤ 0.2 px ± 1 — 日 | delta_d";
  table.columns = {{"set", "set", Align::left, 0, true}, {"body_name", "body_name", Align::left}};
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

TEST(Latex, EscapesFoldsAndSetsNumbers) {
  const std::string text = to_latex(table_of(2), "flow_err");
  EXPECT_THAT(
      text, HasSubstr("50 \\% of \\$$E_t$\\$ \\& \\textquotedbl{}more\\textquotedbl{} \\#1. Low \\{and\\}"));
  EXPECT_THAT(text, HasSubstr("$\\leq$ 0.2 px $\\pm$ 1"));
  EXPECT_THAT(text, HasSubstr("\\begin{table}\n"));
  EXPECT_THAT(text, HasSubstr("set S18-F124\\_134}"));
  EXPECT_THAT(text, HasSubstr("body\\_name & $E_t$ [m] & $E_t$ [m] \\\\\n"));
  EXPECT_THAT(text, HasSubstr("ego & -- & $-$0.100 \\\\\n"));
  EXPECT_THAT(text, HasSubstr("\\label{tab:flow_err}"));
  EXPECT_THAT(to_latex(table_of(8), "wide"), HasSubstr("\\begin{table*}\n\\centering\n"));
}

TEST(Latex, CompilesUnderPdflatex) {
  if (std::system("command -v pdflatex > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "no pdflatex: install texlive-latex-base and texlive-latex-recommended to run this test";
  }
  std::string page =
      "\\documentclass[twocolumn]{article}\n\\usepackage[utf8]{inputenc}\n\\usepackage[T1]{fontenc}\n"
      "\\usepackage{booktabs, amsmath, textcomp}\n\\begin{document}\n";
  for (const int n : {1, 8, 20}) page += to_latex(table_of(n), fmt::format("t{}", n));
  std::string pattern = (std::filesystem::temp_directory_path() / "sextant-latex-XXXXXX").string();
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  const std::filesystem::path folder = pattern;
  write_file(folder / "page.tex", page + "\\end{document}\n");
  const int status = std::system(
      ("cd '" + pattern + "' && pdflatex -interaction=nonstopmode -halt-on-error page.tex > out.txt 2>&1")
          .c_str());
  const std::string words = read_file(folder / "out.txt");
  std::filesystem::remove_all(folder);
  EXPECT_EQ(status, 0) << words;
  EXPECT_THAT(words, testing::Not(HasSubstr("undefined")));
}

}  // namespace
}  // namespace sextant
