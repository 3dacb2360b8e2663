#pragma once

// The tables of the paper (paper_layout.h) as HTML: a fragment for the page of the reproduction, and
// paper.html with all tables and figures in the paper's order for printing on A4.

#include <string>
#include <vector>

#include "sextant/eval/report/document.h"
#include "sextant/eval/report/paper/paper_layout.h"

namespace sextant {

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
