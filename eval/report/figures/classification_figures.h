#pragma once

// (ours) Dynamic or static: how well each test tells them apart. Detections within the gates, as in Table I; dynamic by
// truth. The number that a test decides by is values.motion_sigmas where an estimator's records have it
// (classification.test = likelihood), else values.moving_share (threshold).

#include <vector>

#include "sextant/eval/records/record.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// A row for each data set, sequence, level of noise and estimator: detections, wrong decisions, area under the receiver
/// operating characteristic; of likelihood also the dynamic ones that it missed although faster than
/// values.detectable_kmh.
Table classification_test_table(const std::vector<Record>& records);

/// Receiver operating characteristics: one figure per data set and level, a panel per sequence; none without both kinds.
std::vector<Figure> classification_figures(const std::vector<Record>& records);

}  // namespace sextant
