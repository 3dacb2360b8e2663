#pragma once

// The interface of all estimators, what they start from and what they return, about one body between two
// frames; and the two options that every estimator has, `robust` and `covariance`. How to add one:
// estimator/registry.h.

#include <limits>
#include <memory>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/base/options.h"
#include "sextant/base/status.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"

namespace sextant {

struct ErrorModel;

/// Where a refinement begins: a motion and the points that agree with it.
struct StartingPoint {
  SE3 T_curr_prev;
  std::vector<unsigned char> inliers;  ///< per point; only these are used
  /// What is known of the errors from more points, by joint_flow_depth; none: what these points show.
  std::shared_ptr<const ErrorModel> errors = nullptr;
};

struct MotionEstimate {
  Status status = Status::diverged;        ///< ok, diverged, or why the motion is open (degeneracy.h)
  SE3 T_curr_prev;                         ///< maps the body's points, previous to current camera coordinates
  Matrix6d covariance = Matrix6d::Zero();  ///< of the left twist [rho; omega] (m, rad): inverse Gauss-Newton
                                           ///< Hessian at the optimum in the estimator's own sigmas
  /// Of the covariance: largest over smallest eigenvalue. NaN where there is no covariance.
  double condition = std::numeric_limits<double>::quiet_NaN();
  std::vector<unsigned char> inliers;  ///< per point of the problem: 1 = used in the optimisation
  std::vector<double> refined_flow_u;  ///< px, per point; the measured flow where the estimator refines none
  std::vector<double> refined_flow_v;
  int iterations = 0;
  double cost = 0;  ///< at the optimum, in units of variance
  /// What the covariance was made from; none where errors count as independent.
  std::shared_ptr<const ErrorModel> errors = nullptr;
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

/// The option `robust`: the kernel of the residuals.
enum class Robust { huber, geman_mcclure_gnc, none };
constexpr Names<3> names_of(Robust) { return {"huber", "geman_mcclure_gnc", "none"}; }

/// The option `covariance`: whether errors count as independent from point to point
/// (flow_depth/correlated_covariance.h).
enum class CovarianceOf { independent, correlated };
constexpr Names<2> names_of(CovarianceOf) { return {"independent", "correlated"}; }
inline constexpr const char* covariance_meaning =
    "errors of the points: independent, or correlated over the image, as declared, else as the residuals "
    "show; joint_flow_depth also weighs its points by it";

}  // namespace sextant
