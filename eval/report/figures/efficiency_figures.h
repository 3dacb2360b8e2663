#pragma once

// (ours) How near the errors come to the limit: RMS of E_t and E_R over the RMS of their Cramer-Rao bounds,
// by level, body and estimator, with 95 % intervals. 1: at the bound; below 1 see docs/metrics.md, "The
// limit". One figure per parameter, dataset and sequence with bounds.

#include <vector>

#include "sextant/eval/report/errors_by_level.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

std::vector<Figure> efficiency_figures(const std::vector<NoiseLevelRow>& rows);

}  // namespace sextant
