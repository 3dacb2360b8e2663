#pragma once

// joint_flow_depth: flow and depth are both uncertain, with the previous depth and, if measured, the current
// one (cost: flow_depth_solver.h; docs/method.md). For independent errors the estimated motion equals that of
// the literal cost in Ceres, with every flow and depth as a parameter (ceres_reference.h), to 1e-8 with
// solver.step_tolerance = 1e-9. The default, 1e-6 m or rad, is at most a thousandth of the standard deviation
// of a motion, and saves one pass over all points.
//
//   1. noise levels: those of the options, otherwise declared by the problem, otherwise estimated from the
//      residuals
//   2. graduated Geman-McClure from the starting motion (robust: geman_mcclure_gnc), otherwise a descent with
//      Huber's kernel
//   3. consistent current depths are added, with less weight in areas of relief; points are re-admitted by
//      the chi-square gate of their own covariance. If directions are weakly observable, points outside the
//      gate at the mean of their prior (errors_in_variables.h) are excluded again
//   4. refinement with the kernel of least estimated variance: the optimum for independent errors
//   5. if errors are correlated, as declared or found in the residuals: a step of generalised least squares
//
// Steps 1 to 3 are rough: in single precision, and on samples of 1000 to 2000 points until the last gate.

#include "sextant/base/options.h"
#include "sextant/estimator/flow_depth/correlated_covariance.h"
#include "sextant/estimator/flow_depth/flow_depth_solver.h"
#include "sextant/estimator/solvers/estimator.h"

namespace sextant {

struct JointFlowDepthOptions {
  SEXTANT_OPTIONS(
      (double, sigma_flow_u_px, 0, "px",
       "standard deviation of the flow along u; 0 = declared by the problem, else estimated"),
      (double, sigma_flow_v_px, 0, "px", "standard deviation of the flow along v; 0 as for u"),
      (double, delta_d_px, 0, "px",
       "standard deviation of the disparity behind the depths; 0 as for the flow"),
      (DepthErrors, depth_noise, DepthErrors::depth, "", "quantity with Gaussian errors"),
      (bool, use_depth_curr, true, "", "use the depth measured in the current frame as well"),
      (double, plane_radius_px, 6, "px",
       "the current depth is read at a whole pixel: the slope of a plane through the points within this "
       "distance corrects it to the subpixel target, and its weight decreases with the relief of these "
       "points; 0 = no correction and full weight"),
      (double, projection_share, 0.04, "fraction of the variance",
       "share of the flow's variance in the reprojection term; affects the refined flow, not the motion"),
      (Robust, robust, Robust::geman_mcclure_gnc, "", "robust kernel"),
      (double, huber, 1.345, "sigmas", "threshold of robust = huber"),
      (double, scale, 0, "sigmas", "last scale of Geman-McClure; 0 = the scale of least estimated variance"),
      (double, gate, 0.9999, "probability", "a point is used when its chi-square probability is smaller"),
      (CovarianceOf, covariance, CovarianceOf::correlated, "", covariance_meaning),
      (SolverOptions, solver, {.step_tolerance = 1e-6}, "", "Levenberg-Marquardt"))
  void check() const;
};

/// The remaining minimisation problem once points, noise levels and kernel are chosen.
struct FlowDepthProblem {
  Status status = Status::too_few_points;
  SE3 start;
  NoiseLevels levels;
  RobustKernel kernel;
  MotionPrior prior;                   ///< for weakly observable directions (errors_in_variables.h)
  std::vector<unsigned char> inliers;  ///< per point
};
/// Chooses points, noise levels, kernel and prior, and includes the chosen points in `data`. The status is
/// too_few_points if fewer than three points remain.
FlowDepthProblem decide(const Problem& problem, const StartingPoint& start,
                        const JointFlowDepthOptions& options, FlowDepthData& data);

class JointFlowDepth : public WithOptions<Estimator, JointFlowDepthOptions> {
 public:
  explicit JointFlowDepth(const JointFlowDepthOptions& options) : WithOptions(options) {}
  MotionEstimate estimate(const Problem& problem, const StartingPoint& start) const override;
  bool chooses_points() const override { return true; }
};

}  // namespace sextant
