#pragma once

// Figures of the reproduction, as sections of its document. An experiment that was not measured has none.

#include <filesystem>
#include <optional>
#include <vector>

#include "sextant/eval/report/document.h"
#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/tables/attribution.h"
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

/// One figure per kind of data.
std::vector<Figure> attribution_figures(const std::vector<AttributionPath>& paths);

// ---- Answer: the measured values of one table of the paper as a picture, with a line for every published
// value on the common axis measured / published.
//
//   at 1        the published value
//
//   broad bar   range of 95 % of our single runs;  thin bar: 95 % interval of our mean;  point: the mean
//   filled      our procedure;  open: the procedure of the published code, if the table has it
//   word        verdict of the table on that row
//
// If a value was measured on several kinds of data, the last one in the table is drawn, which is nearest to
// the paper's; with several noises, the first. Values of 0 cannot be drawn on the logarithmic axis.

/// Returns nullopt if no published value was measured.
std::optional<Figure> answer_figure(const std::string& name, const PublishedTable& table);

/// Formats "12 of 40 published values lie in the range of our single runs; 3 rows not measured here".
std::string answer_text(const std::vector<PaperRow>& rows);

}  // namespace sextant
