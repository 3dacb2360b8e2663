#pragma once

// The interface of all estimators. How to add one: estimator/registry.h.

#include "sextant/base/options.h"
#include "sextant/estimator/solvers/motion_estimate.h"
#include "sextant/measurement/problem.h"

namespace sextant {

class Estimator {
 public:
  virtual ~Estimator() = default;
  /// Refines the motion on the starting point's inliers. Never throws for bad measurements: see status.
  virtual MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const = 0;
  /// Whether it looks at all points and chooses among them itself, from the inliers of RANSAC; else the
  /// pipeline chooses for it (point_choice.h).
  virtual bool chooses_points() const { return false; }
  /// All options with their values, for provenance.
  virtual Json options() const = 0;
};

}  // namespace sextant
