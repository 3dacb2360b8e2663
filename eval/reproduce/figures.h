#pragma once

// Figures of the reproduction, as sections of its document. An experiment that was not measured has no
// section.

#include <filesystem>
#include <optional>
#include <vector>

#include "sextant/eval/report/document.h"
#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {

/// A section, and the place in the paper that it belongs to.
struct PlacedSection {
  PaperPlace place = PaperPlace::ours;
  ReportSection section;
};

/// Makes the sections with figures. `parts` is DIR/parts. Records come from `evidence`; paths and pictures
/// from the files of the experiments:
///   recorded/<system>_<sequence>_{estimate,reference}.tum    fig. 6
///   <showcase>/{overlay.png,tracks.csv}                      fig. 1
std::vector<PlacedSection> figure_sections(const std::filesystem::path& parts, const Evidence& evidence,
                                           int jobs);

// ---- Attribution: E_t after each decision on the way from the published code to ours. One panel per set and
// body, one line per path; dashed lines show the values that the paper prints.

/// Returns one figure for each kind of data, such as scenarios or replays.
std::vector<Figure> attribution_figures(const std::vector<AttributionPath>& paths);

// ---- Answer: the measured values of one table of the paper as a picture, with a line for every published
// value on the common axis measured / published.
//
//   at 1        the published value
//   broad bar   range of 95 % of our single runs;  thin bar: 95 % interval of our mean;  point: the mean
//   filled      our procedure;  open: the procedure of the published code, if the table has it
//   word        verdict of the table on that row
//
// If a value was measured on several kinds of data, the last one in the table is drawn, which is nearest to
// the paper's; with several noises, the first. Values of 0 cannot be drawn on the logarithmic axis, and
// values beyond 0.02 .. 50 are drawn at its ends. The first 26 lines are drawn; the caption states how many
// there are.

/// Returns nullopt if there is no line: no published value above 0 was measured by one of the two procedures.
std::optional<Figure> answer_figure(const std::string& name, const PublishedTable& table);

/// Formats "12 of 40 comparisons: the published value lies where our single runs do; 3 not measured here".
std::string answer_text(const std::vector<PaperRow>& rows);

}  // namespace sextant
