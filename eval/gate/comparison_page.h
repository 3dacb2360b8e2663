#pragma once

// report.html of `sextant compare --out`: the verdict, what differs, the tables, and for every error that changed the
// frame in which it changed most, with the line that shows both runs there and links to the records of both.

#include <filesystem>

#include "sextant/eval/gate/comparison.h"
#include "sextant/eval/report/document.h"

namespace sextant {

/// The page will lie in `out`. Frames are named where both sides are one folder with records each.
ReportDocument comparison_document(const Comparison& comparison, const std::filesystem::path& out);

}  // namespace sextant
