#pragma once

// Errors against the level of the noise, one figure a track: E_t of the camera and of the objects, each with its
// 95 % interval. Reference systems may stand in grey behind.

#include <vector>

#include "sextant/eval/benchmark/card_document.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Tracks with two levels or more. An estimator of the references that `cards` have too is left out behind.
std::vector<Figure> curve_figures(const Suite& suite, const std::vector<const Card*>& cards,
                                  const std::vector<const Card*>& references);

Figure profile_figure(const std::vector<ProfileRow>& rows);

}  // namespace sextant
