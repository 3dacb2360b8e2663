#pragma once

// Helpers for tests of reports.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/base/new_file.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/noise_sweep.h"

namespace sextant {

// ---- Hostile texts that must remain text on their way through a figure or table.

/// Texts with commands; executing any of them would create the file `planted`.
inline std::vector<std::string> hostile_texts(const std::filesystem::path& planted) {
  const std::string command = "touch " + planted.string();
  return {"`" + command + "`",
          "$(" + command + ")",
          "'.system('" + command + "').'",
          "\".system(\"" + command + "\").\"",
          "''`" + command + "`''",
          "x'\nsystem \"" + command + "\"\n#",
          "x\n!" + command + "\nx",
          "x\\\n!" + command,
          "< " + command,
          "<" + command,
          "| " + command,
          "|" + command,
          "@planted",
          "100 % of %s %d %n %%",
          "{/Times=40 a_b^c&{d}~e}",
          "}{",
          "a\\",
          "\\",
          "a,b;\"c\" 'd'",
          "<b>&amp;</b><script>",
          "<![CDATA[ ]]></title>]]]>",
          "\x1b[2J\x07",
          "no \xff\xc0 UTF-8 \uFFFE",
          "# comment",
          "  blanks  "};
}

/// Expects that all figures are drawn as well-formed XML, and that no command was executed.
inline void expect_drawn(const std::vector<Figure>& figures, const std::filesystem::path& planted) {
  ASSERT_FALSE(figures.empty());
  const OutputFiles files = draw(figures, 2);
  EXPECT_FALSE(std::filesystem::exists(planted));
  const std::filesystem::path svg = planted.string() + ".svg";
  for (const auto& [name, bytes] : files) {
    if (!name.ends_with(".svg")) continue;
    write_file(svg, bytes);
    EXPECT_EQ(std::system(("xmllint --noout '" + svg.string() + "'").c_str()), 0) << name;
    std::filesystem::remove(svg);
  }
}

// ---- Tables compiled with pdflatex.

inline constexpr const char* no_pdflatex =
    "no pdflatex: install texlive-latex-base and texlive-latex-recommended to run this test";

struct Compiled {
  bool ok = false;
  std::string words;
};

/// Compiles a whole document; empty if pdflatex is not installed.
inline std::optional<Compiled> compile_latex_document(const std::string& text) {
  if (std::system("command -v pdflatex > /dev/null 2>&1") != 0) return std::nullopt;
  const ScratchFolder scratch("sextant-latex-");
  const std::string folder = scratch.path().string();
  write_file(folder + "/page.tex", text);
  const std::string command =
      "cd '" + folder + "' && pdflatex -interaction=nonstopmode -halt-on-error page.tex > out.txt 2>&1";
  const int status = std::system(command.c_str());
  return Compiled{status == 0, read_file(folder + "/out.txt")};
}

/// Compiles a two-column page with this body.
inline std::optional<Compiled> compile_latex(const std::string& body) {
  return compile_latex_document(
      "\\documentclass[twocolumn]{article}\n\\usepackage[utf8]{inputenc}\n\\usepackage[T1]{fontenc}\n"
      "\\usepackage{booktabs, amsmath, textcomp}\n\\extrafloats{100}\n\\begin{document}\n" +
      body + "\\end{document}\n");
}

// ---- Sweeps of records made by hand.

/// Makes a sweep of these records.
inline NoiseSweep noise_sweep_of(const std::string& parameter, const std::vector<Record>& records) {
  NoiseLevels levels;
  for (const Record& record : records) levels.add(record);
  return {parameter, levels.take(), levels.estimators()};
}

}  // namespace sextant
