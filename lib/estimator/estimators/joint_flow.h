#pragma once

// The two estimators of the paper.
//
// motion_only (paper eq. (4), (10)) minimises  sum_i h(p_i + phi_i - project(X m_i))  over X, where h is
// Huber's kernel with covariance Sigma_1 = sigma^2 I. The flow is not refined.
//
// joint_flow (paper eq. (11)) minimises over X and every refined flow phihat_i
//
//   sum_i h1(p_i + phihat_i - project(X m_i)) + h2(phi_i - phihat_i),
//
// where h1, h2 are Huber's kernels with covariances sigma_projection^2 I and sigma_flow^2 I. The flows are
// eliminated in closed form (robust_kernel.h): X is the optimum of motion_only with the effective kernel, and
// the refined flow follows per point. The result equals that of the literal cost in Ceres (ceres_reference.h)
// to 1e-8 in X and 1e-6 px in the flow.
//
// Two options are not in the paper and are implemented in flow_depth/: robust = geman_mcclure_gnc
// (graduation.h) and covariance = correlated (correlated_covariance.h).

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

  HuberKernel projection_kernel() const { return {sigma_projection_px, threshold(huber_projection)}; }
  HuberKernel flow_kernel() const { return {sigma_flow_px, threshold(huber_flow)}; }
  /// Returns the threshold `huber`, or infinity for any other kernel than Huber's: the residual is then split
  /// by variance, as in least squares.
  double threshold(double huber) const {
    return robust == Robust::huber ? huber : std::numeric_limits<double>::infinity();
  }
  HuberKernel effective_kernel() const { return infimal_convolution(projection_kernel(), flow_kernel()); }
};

class JointFlow : public WithOptions<Estimator, JointFlowOptions> {
 public:
  explicit JointFlow(const JointFlowOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
  bool chooses_points() const override { return options_.robust == Robust::geman_mcclure_gnc; }
};

}  // namespace sextant
