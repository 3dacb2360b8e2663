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
  std::vector<unsigned char> inliers;  ///< per point; only these are used
  /// Error model estimated from more points (by joint_flow_depth); null: the model is estimated from the
  /// inliers.
  std::shared_ptr<const ErrorModel> errors = nullptr;
};

struct MotionEstimate {
  Status status = Status::diverged;  ///< ok, diverged, or why the motion is not determined (degeneracy.h)
  SE3 T_curr_prev;                   ///< maps the body's points from previous to current camera coordinates
  Matrix6d covariance = Matrix6d::Zero();  ///< covariance of the left twist [rho; omega] (m, rad): inverse
      ///< Gauss-Newton Hessian at the optimum, with the estimator's sigmas
  /// Condition number of the covariance: largest over smallest eigenvalue. NaN if there is no covariance.
  double condition = std::numeric_limits<double>::quiet_NaN();
  std::vector<unsigned char> inliers;  ///< per point of the problem: 1 = used in the optimisation
  /// px, per point; the measured flow if the estimator does not refine it
  std::vector<double> refined_flow_u;
  std::vector<double> refined_flow_v;
  int iterations = 0;
  double cost = 0;  ///< cost at the optimum, in units of variance
  /// Error model behind the covariance; null if errors are treated as independent.
  std::shared_ptr<const ErrorModel> errors = nullptr;
};

class Estimator {
 public:
  virtual ~Estimator() = default;
  /// Refines the motion on the starting point's inliers. Bad measurements never cause an exception; see
  /// status.
  virtual MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const = 0;
  /// Returns true if the estimator selects its inliers from all points itself, beginning with those of
  /// RANSAC; otherwise the pipeline selects them (point_choice.h).
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
    "errors of the points: independent, or correlated over the image, as declared, else as the residuals "
    "show; joint_flow_depth also weighs its points by it";

}  // namespace sextant
