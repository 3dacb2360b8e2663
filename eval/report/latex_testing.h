#pragma once

// Compiles tables with pdflatex in tests.

#include <cstdlib>
#include <optional>
#include <string>

#include "sextant/base/files.h"
#include "sextant/base/new_file.h"

namespace sextant {

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

}  // namespace sextant
