#pragma once

#include <memory>

#include "sextant/eval/experiment/case_estimator.h"

namespace sextant {

/// Returns an estimator that passes on the points of every body and estimates no motion. Its records have the
/// bounds of every estimator whose bodies have the same points: those of external programs, whose objects
/// pass no gate, and those of other estimators for objects that passed the gates of the pipeline.
std::shared_ptr<const CaseEstimator> points_without_estimate();

}  // namespace sextant
