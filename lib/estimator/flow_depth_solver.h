#pragma once

// The structured problem of one rigid body: flow and depth are both uncertain. For every point the unknowns
// are its inverse depth s (1/m) and its refined flow; X = T_curr_prev is shared. With ray m = [x y 1] of the
// pixel, a = R m, w = a_z + s t_z:
//
//   u'(s) = fx (a_x + s t_x) / w + cx,  v'(s) likewise,  s'(s) = 1 / z' = s / w
//
//   q(X, s) = ((u' - u - flow_u) / sigma_u)^2 + ((v' - v - flow_v) / sigma_v)^2 + D(s; 1 / depth, kappa)
//             [ + D(s'; 1 / depth_curr, kappa_curr) ],      kappa = delta_d / bf
//   C(X) = 1/2 sum_i rho(min_s q_i(X, s)),   rho: robust_kernel.h
//
// Refined flows have left q in closed form (huber.h: variances of the two terms add). The minimum over s is
// taken by Newton's method to convergence for every point and every X, four points at a time; the 6x6 system
// is its Schur complement. Descents on the way are rough: they take one step of s per X.
// D is the deviance of the depth measurement, by DepthNoise:
//
//   disparity   D = ((s - sm) / kappa)^2: bf s is measured with standard deviation delta_d
//   depth       D = ((s - sm) / kappa)^2 (2 s + sm) / (3 sm): the depth is measured without bias and with
//               standard deviation depth^2 kappa of the *true* depth. This is the quasi-likelihood of that
//               noise (Wedderburn 1974): its score (z - zm) / (z^2 kappa)^2 has mean zero exactly, whereas
//               sigma taken at the measured depth prefers points that came out too near.
//
// delta_d = 0 fixes the depth: motion_only's cost. Units: px, m, rad.

#include <optional>
#include <vector>

#include "sextant/estimator/levenberg_marquardt.h"
#include "sextant/estimator/motion_prior.h"
#include "sextant/estimator/robust_kernel.h"
#include "sextant/measurement/problem.h"

namespace sextant {

enum class DepthNoise { depth, disparity };

/// Standard deviations of the measurements of one body.
struct NoiseLevels {
  double sigma_flow_u_px = 1;
  double sigma_flow_v_px = 1;
  double delta_d_px = 0;       ///< 0 = the depth is exact
  double delta_d_curr_px = 0;  ///< of the current depth where there is one; 0 = do not use it
  DepthNoise depth_noise = DepthNoise::depth;
  bool as_measured = false;  ///< q and gradient to first order about the measured depths, which stay
};

/// The depth measurements of one point and the square roots of their information (m); 0 = no such
/// measurement.
struct PointDepths {
  double inverse_depth = 0;  ///< 1/m
  double weight = 0;
  double inverse_depth_curr = 1;
  double weight_curr = 0;
};

/// How the minimum over s is taken, and what Hessians contain. Rough: one step of s, and Gauss-Newton
/// without the kernel's own curvature, of a quadratic that lies above the cost, so that steps descend. That
/// is never indefinite but ignores that errors of depths change the Jacobians: where those are a share of the
/// relief, steps shrink by no more than that share (errors_in_variables.h). Newton's is exact, and converges
/// quadratically.
enum class Curvature { rough, gauss_newton, newton };

/// The points as padded structure of arrays, and the inverse depths that the last evaluation found.
class FlowDepthData {
 public:
  /// All points of the problem; those with numbers that are no measurement (NaN, depth <= 0) never count.
  explicit FlowDepthData(const Problem& problem);

  size_t size() const { return size_; }
  const StereoCamera& camera() const { return camera_; }
  /// Whether point i counts, and whether its current depth does.
  void use(size_t i, bool point, bool depth_curr);
  bool used(size_t i) const { return weight_[i] > 0; }
  bool uses_depth_curr(size_t i) const { return has_curr_[i] > 0; }
  bool measures_depth_curr(size_t i) const { return valid_curr_[i] != 0; }
  double inverse_depth_curr(size_t i) const { return inverse_depth_curr_[i]; }
  bool is_measurement(size_t i) const { return valid_[i] != 0; }
  size_t n_used() const;
  /// Every k-th of the points that count, without their current depths: `size` to 2 `size` of them, or all.
  FlowDepthData sample(size_t size) const;
  void forget_depth_curr(size_t i) { valid_curr_[i] = 0; }
  void shift_inverse_depth_curr(size_t i, double change) { inverse_depth_curr_[i] += change; }
  /// Back to the measured depths, from which the next evaluation starts.
  void reset_depths() { refined_ = inverse_depth_; }

  /// What point i says about depth under these levels.
  PointDepths depths(size_t i, const NoiseLevels& levels) const;

  static constexpr size_t lanes = 4;

 private:
  FlowDepthData(const StereoCamera& camera, size_t size);
  friend struct FlowDepthLanes;
  friend NormalEquations accumulate(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                                    const RobustKernel& kernel, Curvature curvature);
  friend void evaluate_distances(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                                 std::vector<double>& q);
  friend void evaluate_points(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                              struct PointEvaluation& out);
  StereoCamera camera_;
  size_t size_ = 0;
  std::vector<unsigned char> valid_, valid_curr_;
  std::vector<double> x_, y_, target_u_, target_v_, inverse_depth_, inverse_depth_curr_, weight_, has_curr_;
  std::vector<double> refined_, q_, error_u_, error_v_, slope_u_, slope_v_;
};

/// Per point at X, after the minimum over its depth.
struct PointEvaluation {
  std::vector<double> q;        ///< squared Mahalanobis distance; +inf behind the camera or no measurement
  std::vector<double> error_u;  ///< u' - u - flow_u, px
  std::vector<double> error_v;
  std::vector<double> slope_u;  ///< d u' / d s, px m
  std::vector<double> slope_v;
  std::vector<double> inverse_depth;       ///< refined, 1/m
  std::vector<double> inverse_depth_curr;  ///< predicted from it at X, 1/m
  std::vector<double> x_curr, y_curr;      ///< (u' - cx) / fx, (v' - cy) / fy
};
void evaluate_points(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                     PointEvaluation& out);

/// Only q, to the first order after one step of the depth: for choosing points.
void evaluate_distances(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                        std::vector<double>& q);

NormalEquations accumulate(FlowDepthData& data, const SE3& T_curr_prev, const NoiseLevels& levels,
                           const RobustKernel& kernel, Curvature curvature = Curvature::gauss_newton);

/// X after one rough step that is not looked back at; none if it leads nowhere. `size`: its largest
/// component, m or rad.
std::optional<SE3> step_flow_depth(FlowDepthData& data, const SE3& from, const NoiseLevels& levels,
                                   const RobustKernel& kernel, double* size = nullptr);

/// Rough, and stops at steps of 1e-5 m or rad.
SolverResult descend(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                     const RobustKernel& kernel, int max_iterations);

SolverResult minimize_flow_depth(FlowDepthData& data, const SE3& start, const NoiseLevels& levels,
                                 const RobustKernel& kernel, const SolverOptions& options,
                                 const MotionPrior& prior = {});

}  // namespace sextant
