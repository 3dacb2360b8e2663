#pragma once

// motion_only (paper eq. (4), (10)): minimise  sum_i h(p_i + phi_i - project(X m_i))  over X, h Huber with
// covariance Sigma_1 = sigma^2 I. The flow is not refined.

#include "sextant/base/with_options.h"
#include "sextant/estimator/estimators/correlated_covariance.h"
#include "sextant/estimator/estimators/estimator.h"
#include "sextant/estimator/estimators/robust_choice.h"
#include "sextant/estimator/solvers/reprojection_solver.h"

namespace sextant {

struct MotionOnlyOptions {
  SEXTANT_OPTIONS(
      (double, sigma_px, 1.0, "px", "standard deviation of the reprojection error per axis"),
      (double, huber, 1.345, "sigmas", "Huber threshold"),  // 95 % efficiency on Gaussian data (Huber 1981)
      (Robust, robust, Robust::huber, "", "kernel"),
      (CovarianceOf, covariance, CovarianceOf::independent, "", covariance_meaning),
      (SolverOptions, solver, {}, "", "Levenberg-Marquardt"))
  void check() const;
};

class MotionOnly : public WithOptions<Estimator, MotionOnlyOptions> {
 public:
  explicit MotionOnly(const MotionOnlyOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
  bool chooses_points() const override { return options_.robust == Robust::geman_mcclure_gnc; }
};

/// What motion_only and joint_flow share: solve with a kernel, fill in everything but the refined flow.
/// robust = none: no threshold; geman_mcclure_gnc: graduation.h on all points, scale estimated from their
/// residuals, inliers = points within three times that scale.
MotionEstimate estimate_with_kernel(const Problem& problem, const StartingPoint& start, HuberKernel kernel,
                                    Robust robust, const SolverOptions& options);

}  // namespace sextant
