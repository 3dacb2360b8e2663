#pragma once

// The interface of all estimators and the table of those that exist. How to add one:
//   1. write lib/estimator/<name>.{h,cc}: an options struct (base/options.h) and a class derived from
//   Estimator;
//   2. add one line to the table in registry.cc.
// The parametrised test in registry_test.cc then runs over it.

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/estimator/motion_estimate.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Where a refinement begins: a motion and the points that agree with it.
struct StartingPoint {
  SE3 T_curr_prev;
  std::vector<unsigned char> inliers;  ///< per point; only these are used
};

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

struct EstimatorEntry {
  std::string name;
  std::string description;
  std::function<std::unique_ptr<Estimator>(const Json& options)> make;  ///< strict options, {} = defaults
  std::function<std::vector<OptionHelp>()> options;
};

std::span<const EstimatorEntry> estimators();

/// Throws Error on an unknown name (with the nearest one) or an unknown option key.
std::unique_ptr<Estimator> make_estimator(const std::string& name, const Json& options = Json::object());

}  // namespace sextant
