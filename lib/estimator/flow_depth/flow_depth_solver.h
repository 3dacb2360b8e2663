#pragma once

// Structured problem of one rigid body with uncertain flow and depth. The unknowns of each point are its
// inverse depth s (1/m) and its refined flow; X = T_curr_prev is shared. With the ray m = [x y 1] of the
// pixel, a = R m, w = a_z + s t_z:
//
//   u'(s) = fx (a_x + s t_x) / w + cx,  v'(s) likewise,  s'(s) = 1 / z' = s / w
//
//   q(X, s) = ((u' - u - flow_u) / sigma_u)^2 + ((v' - v - flow_v) / sigma_v)^2 + D(s; 1 / depth, kappa)
//             [ + D(s'; 1 / depth_curr, kappa_curr) ],      kappa = delta_d / bf
//   C(X) = 1/2 sum_i rho(min_s q_i(X, s)),   rho: robust_kernel.h
//
// Refined flows are eliminated in closed form: the variances of the two terms add. The minimum over s is
// computed by Newton's method, to convergence for every point and every X, several points at a time; the 6x6
// system is its Schur complement. Intermediate descents are rough: they take one step of s per X. D is the
// deviance of the depth measurement (option DepthErrors):
//
//   disparity   D = ((s - sm) / kappa)^2: bf s is measured with standard deviation delta_d
//   depth       D = ((s - sm) / kappa)^2 (2 s + sm) / (3 sm): the depth is measured without bias and with
//               standard deviation depth^2 kappa of the *true* depth. This is the quasi-likelihood of that
//               noise (Wedderburn 1974): its score (z - zm) / (z^2 kappa)^2 has mean zero exactly, whereas a
//               sigma taken at the measured depth favours points measured too near.
//
// delta_d = 0 fixes the depth: motion_only's cost. Units: px, m, rad.

#include <optional>

#include "sextant/estimator/flow_depth/flow_depth_points.h"
#include "sextant/estimator/solvers/levenberg_marquardt.h"
#include "sextant/estimator/solvers/robust_kernel.h"

namespace sextant {

// Gaussian prior of a motion about `mean`,
//
//   C(X) += 1/2 xi^T precision xi,   xi = [t - t_m + [t_m]x w; w],  w = 2 vec(q q_m^-1)
//
// where X has the rotation q (unit quaternion) and the translation t, `mean` has q_m and t_m, and xi is to
// first order the left twist of X mean^-1. Units: m, rad.

struct MotionPrior {
  SE3 mean;
  Matrix6d precision = Matrix6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();  ///< covariance of `mean`
  Matrix6d cross = Matrix6d::Zero();       ///< covariance of the points' score and `mean`
  Matrix6d bias = Matrix6d::Zero();        ///< second moment of the bias that the prior may cause

  bool holds() const { return !precision.isZero(0); }
};

void add_prior(const MotionPrior& prior, const SE3& T_curr_prev, NormalEquations& equations);

/// Minimisation over s, and content of the Hessian:
///
///   rough         one step of s; Gauss-Newton without the kernel's second derivative, on a quadratic upper
///                 bound of the cost, so that steps descend
///   gauss_newton  s converges; with the kernel's second derivative where it leaves the Hessian positive
///                 semi-definite
///   newton        s converges; exact Hessian, with which steps converge quadratically
///
/// The first two Hessians are never indefinite but neglect that depth errors change the Jacobians: if these
/// errors are a share of the relief, steps are shorter by at most that share (errors_in_variables.h).
enum class Curvature { rough, gauss_newton, newton };

/// Computes all per-point results of FlowDepthPoints at X.
template <typename Real>
void evaluate_points(FlowDepthPoints<Real>& data, const SE3& T_curr_prev, const NoiseLevels& levels);

/// Computes only q, to first order after one step of the depth, for the choice of points.
void evaluate_distances(RoughFlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels);

template <typename Real>
NormalEquations accumulate(FlowDepthPoints<Real>& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                           const RobustKernel& kernel, Curvature curvature = Curvature::gauss_newton);

/// Returns X after one rough step without a line search; nullopt if it is not finite. Stores the largest
/// absolute component of the step (m or rad) in `size`, unless that is null.
std::optional<SE3> step_flow_depth(RoughFlowDepthData& data, const SE3& from, const NoiseLevels& levels,
                                   const RobustKernel& kernel, double* size = nullptr);

/// Minimises with rough steps until they are smaller than 1e-5 m or rad, with at most max_iterations.
SolverResult descend(RoughFlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                     const RobustKernel& kernel, int max_iterations);

/// Minimises like minimize_flow_depth(), but in single precision, where an iteration costs half as much, and
/// for 2000 points or more first on a sample of 1000. Returns a motion near the optimum (typically within
/// 1e-4 m or rad), from which one step in double precision is enough, and stores the refined depths in
/// `data`. Returns `start` for fewer than 300 points and if a result is not finite.
SE3 minimize_roughly(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                     const RobustKernel& kernel, const MotionPrior& prior);

/// Minimises C(X), plus the prior if its precision is not 0, in double precision.
SolverResult minimize_flow_depth(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                                 const RobustKernel& kernel, const SolverOptions& options,
                                 const MotionPrior& prior = {});

}  // namespace sextant
