#pragma once

// Interface of all estimators of one body between two frames, their input and output, and the two options
// that every estimator has, `robust` and `covariance`. How to add one: estimator/registry.h.

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

/// Initial motion of a refinement, and the inliers it uses.
struct StartingPoint {
  SE3 T_curr_prev;
  /// per point; only inliers are used, except by an estimator that chooses its points (chooses_points())
  std::vector<unsigned char> inliers;
  /// Error model estimated from more points (by joint_flow_depth); null: the model is estimated from the
  /// inliers.
  std::shared_ptr<const ErrorModel> errors = nullptr;
};

struct MotionEstimate {
  Status status = Status::diverged;  ///< ok, diverged, or why the motion is not determined (degeneracy.h)
  SE3 T_curr_prev;                   ///< maps the body's points from previous to current camera coordinates
  /// Covariance of the left twist [rho; omega] (m, rad) from the estimator's noise levels. motion_only and
  /// joint_flow: inverse Hessian at the optimum, with robust = geman_mcclure_gnc times variance_factor();
  /// joint_flow_depth: see errors_in_variables.h. With covariance = correlated: see correlated_covariance.h.
  Matrix6d covariance = Matrix6d::Zero();
  /// Condition number of the covariance: largest over smallest eigenvalue. NaN if there is no covariance.
  double condition = std::numeric_limits<double>::quiet_NaN();
  std::vector<unsigned char> inliers;  ///< per point of the problem: 1 = used in the optimisation
  /// Refined flow of each point, px; the measured flow if the estimator does not refine it
  std::vector<double> refined_flow_u;
  std::vector<double> refined_flow_v;
  int iterations = 0;
  double cost = 0;  ///< cost at the optimum: 1/2 sum rho(q) over normalised residuals, plus that of a prior
  /// Error model behind the covariance of joint_flow_depth with covariance = correlated; null for all other
  /// estimators, and for errors that are treated as independent.
  std::shared_ptr<const ErrorModel> errors = nullptr;
};

class Estimator {
 public:
  virtual ~Estimator() = default;
  /// Refines the motion of `start`. Unusable measurements never cause an exception; the status of the
  /// estimate reports them.
  virtual MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const = 0;
  /// Returns true if the estimator selects its inliers from all points itself, beginning with those of
  /// RANSAC; otherwise the pipeline selects them (choose_points() in start/robust_start.h).
  virtual bool chooses_points() const { return false; }
  /// Returns all options with their values, for provenance.
  virtual Json options() const = 0;
};

/// Option `robust`: the robust kernel of the residuals.
enum class Robust { huber, geman_mcclure_gnc, none };
constexpr Names<3> names_of(Robust) { return {"huber", "geman_mcclure_gnc", "none"}; }

/// Option `covariance`: errors are independent between points, or correlated over the image
/// (flow_depth/correlated_covariance.h).
enum class CovarianceOf { independent, correlated };
constexpr Names<2> names_of(CovarianceOf) { return {"independent", "correlated"}; }
inline constexpr const char* covariance_meaning =
    "errors of different points count as independent, or as correlated over the image with the declared "
    "correlation, else with one estimated from the residuals; joint_flow_depth also weighs its points by it";

}  // namespace sextant
