#pragma once

// The figures of the reproduction, as sections of its document. A part that was not measured has none.

#include <filesystem>

#include "sextant/eval/report/document.h"
#include "sextant/eval/report/evidence.h"

namespace sextant {

/// `parts`: DIR/parts. Records come from `evidence`; paths and pictures from the parts' own files:
///   recorded/<system>_<sequence>_{estimate,reference}.tum    fig. 6
///   <showcase part>/{overlay.png,tracks.csv}                 fig. 1
void add_figure_sections(const std::filesystem::path& parts, const Evidence& evidence, int jobs,
                         ReportDocument& document);

}  // namespace sextant
