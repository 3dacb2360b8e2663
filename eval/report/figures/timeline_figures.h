#pragma once

// Errors over the frames of a source, one panel an error, one line a body: the camera and up to five objects, those
// with the most estimates. Logarithmic; a line breaks where a body has no estimate with truth. Dashed: the floor
// of the truth itself, below which E_t of the camera says nothing (step_floor_m), where the data set tells.
// One figure per dataset, sequence and estimator, of the records of its lowest seed.

#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/run_summary.h"

namespace sextant {

/// E_t, E_R and E_v as the preset has them, and the EPE after the optimisation; panels without a number are left out.
std::vector<Figure> timeline_figures(const std::vector<Record>& records, const MetricPreset& preset);

}  // namespace sextant
