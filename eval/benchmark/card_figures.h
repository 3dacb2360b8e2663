#pragma once

// Errors over the noise level, one figure per track: E_t of the camera and of the objects, each with its 95 %
// interval. Reference systems may be drawn in grey behind them.

#include <vector>

#include "sextant/eval/benchmark/card_document.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Makes figures of the tracks with two levels or more. A reference whose estimator is also among `cards` is
/// left out.
std::vector<Figure> curve_figures(const Suite& suite, const std::vector<const Card*>& cards,
                                  const std::vector<const Card*>& references);

Figure profile_figure(const std::vector<ProfileRow>& rows);

}  // namespace sextant
