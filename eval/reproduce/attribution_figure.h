#pragma once

// E_t after each decision on the way from the published code to ours, one panel per set and body, one line per path;
// the values that the paper prints as dashed lines.

#include <vector>

#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/tables/attribution.h"

namespace sextant {

/// One figure per kind of data.
std::vector<Figure> attribution_figures(const std::vector<AttributionPath>& paths);

}  // namespace sextant
