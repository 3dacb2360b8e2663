#pragma once

// Errors of sets of frames by body and estimator.
//
//   EPE            fig. 5: mean end-point error of the flow before and after the optimisation, bars with 95 %
//                  intervals (bootstrap over seeds), one diagram a set. Records whose true flow is given
//   distribution   (ours) boxes of the compared errors (metrics/definitions.h): quartiles and median, whiskers
//                  at 5 and 95 %; one figure a set

#include <vector>

#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/figures/record_sets.h"

namespace sextant {

std::vector<Figure> epe_figures(const std::vector<RecordSet>& sets);
std::vector<Figure> distribution_figures(const std::vector<RecordSet>& sets);

}  // namespace sextant
