#pragma once

// The two estimators of the paper.
//
// motion_only (paper eq. (4), (10)) minimises the robust reprojection error of the measured flow over the
// motion X. The flow is not refined.
//
// joint_flow (paper eq. (11)) minimises the sum of two robust errors over X and the refined flow of every
// point: the reprojection error of the refined flow, and its difference from the measured flow. The flows are
// eliminated in closed form; both costs and the closed form stand in joint_flow.cc. The result equals that of
// the literal cost in Ceres (ceres_reference.h) to 1e-8 in X and 1e-6 px in the flow.
//
// Two options are not in the paper and are implemented in flow_depth/: robust = geman_mcclure_gnc
// (graduation.h) and covariance = correlated (correlated_covariance.h).

#include <Eigen/Core>

#include "sextant/base/options.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/estimator/solvers/reprojection_solver.h"

namespace sextant {

struct MotionOnlyOptions {
  SEXTANT_OPTIONS((double, sigma_px, 1.0, "px", "standard deviation of the reprojection error per axis"),
                  (double, huber, 1.345, "sigmas",
                   "Huber threshold"),  // 95 % efficiency on Gaussian data (Huber 1981)
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

struct JointFlowOptions {
  SEXTANT_OPTIONS((double, sigma_projection_px, 0.4, "px",
                   "Sigma_1: reprojection error of the refined flow, per axis"),
                  (double, sigma_flow_px, 0.8, "px", "Sigma_2: error of the measured flow, per axis"),
                  (double, huber_projection, 1.345, "sigmas", "Huber threshold of the reprojection term"),
                  (double, huber_flow, 1.345, "sigmas", "Huber threshold of the flow term"),
                  (Robust, robust, Robust::huber, "", "kernel"),
                  (CovarianceOf, covariance, CovarianceOf::independent, "", covariance_meaning),
                  (SolverOptions, solver, {}, "", "Levenberg-Marquardt"))
  void check() const;

  HuberKernel projection_kernel() const;
  HuberKernel flow_kernel() const;
  /// Returns the kernel with which motion_only has the same optimum.
  HuberKernel effective_kernel() const;
};

/// Returns the kernel of the minimum over all splits r = a + b of the projection term at a plus the flow term
/// at b.
HuberKernel infimal_convolution(const HuberKernel& projection, const HuberKernel& flow);

/// Returns the part b of r that the flow term takes at that minimum; a = r - b remains for the projection
/// term. If both terms reach their thresholds at the same |r|, the minimum is a segment, and b is the share
/// of r by variance, as below the thresholds.
Eigen::Vector2d split_residual(const Eigen::Vector2d& r, const HuberKernel& projection,
                               const HuberKernel& flow);

class JointFlow : public WithOptions<Estimator, JointFlowOptions> {
 public:
  explicit JointFlow(const JointFlowOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
  bool chooses_points() const override { return options_.robust == Robust::geman_mcclure_gnc; }
};

}  // namespace sextant
