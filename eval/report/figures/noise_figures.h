#pragma once

// The figures of a noise sweep.
//
//   error against level   one per dataset, sequence and estimator, as fig. 4 of the paper: curves are E_t on
//                         the left axis, bars E_R on the right one; camera and objects in one frame; bands and
//                         whiskers are 95 % intervals of the mean
//   estimators            one per dataset, sequence and body with two or more estimators: E_t of each
//   achieved noise        one per source: achieved over requested, by level and channel

#include <vector>

#include "sextant/eval/report/achieved_noise.h"
#include "sextant/eval/report/errors_by_level.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Rows of one sweep. Nothing where there are fewer than two levels.
std::vector<Figure> noise_level_figures(const std::vector<NoiseLevelRow>& rows);

std::vector<Figure> achieved_noise_figures(const std::vector<AchievedNoiseRow>& rows);

}  // namespace sextant
