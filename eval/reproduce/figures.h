#pragma once

// The figures of the reproduction, as sections of its document. A part that was not measured has none.

#include <filesystem>
#include <optional>
#include <vector>

#include "sextant/eval/report/document.h"
#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/tables/attribution.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {

struct PlacedSection {
  PaperPlace place = PaperPlace::ours;
  ReportSection section;
};

/// `parts`: DIR/parts. Records come from `evidence`; paths and pictures from the parts' own files:
///   recorded/<system>_<sequence>_{estimate,reference}.tum    fig. 6
///   <showcase part>/{overlay.png,tracks.csv}                 fig. 1
std::vector<PlacedSection> figure_sections(const std::filesystem::path& parts, const Evidence& evidence,
                                           int jobs);

// ---- attribution: E_t after each decision on the way from the published code to ours, one panel per set
// and body, one line per path; the values that the paper prints as dashed lines.

/// One figure per kind of data.
std::vector<Figure> attribution_figures(const std::vector<AttributionPath>& paths);

// ---- answer: what a reproduction says of one table of the paper, as a picture: a line for every published
// value, all on one axis, measured / published.
//
//   at 1        the published value
//   broad bar   where 95 % of our single runs lie;  thin bar: 95 % interval of our mean;  point: the mean
//   filled      our procedure;  open: that of the published code, where the table has it
//   word        the verdict of the table on that row
//
// Of several kinds of data for one value the last in the table, the nearest to the paper's, is drawn; of
// several noises the first. Values of 0 have no place on the axis.

/// None where no published value was measured.
std::optional<Figure> answer_figure(const std::string& name, const PublishedTable& table);

/// "12 of 40 published values lie in the range of our single runs; 3 rows not measured here".
std::string answer_text(const std::vector<PaperRow>& rows);

}  // namespace sextant
