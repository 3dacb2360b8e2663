#pragma once

// Robust start: AP3P (P3PSolutions) inside RANSAC (Fischler & Bolles), compared with the propagated motion.
// The model with more inliers wins, the propagated one on a tie (paper sec. IV-B). Each sample is a pure
// function of its index and the number of points: it depends neither on a state nor on clock or thread.

#include <array>
#include <optional>

#include "sextant/base/names.h"
#include "sextant/base/options.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/problem.h"

namespace sextant {

struct RobustStartOptions {
  SEXTANT_OPTIONS((double, inlier_threshold_px, 1.0, "px",
                   "largest reprojection error of an inlier of the start; refine_on determines which "
                   "points the refinement uses"),
                  (double, confidence, 0.999, "probability",
                   "of drawing at least one all-inlier sample; determines the number of samples"),
                  (int, max_iterations, 500, "count", "largest number of samples"),
                  (int, min_iterations, 20, "count", "smallest number of samples"),
                  (int, local_refinements, 2, "count",
                   "least-squares fits to the winner's inliers, each kept only if it has more inliers"))
  void check() const;
};

struct RobustStart {
  Status status = Status::too_few_points;  ///< ok, too_few_points, collinear or at_infinity
  StartingPoint point;
  int n_inliers = 0;
  int iterations = 0;
  bool propagated = false;  ///< the propagated motion won against RANSAC
};

/// Computes the start; status too_few_points if fewer than 4 points, or fewer than 4 inliers, are found.
/// `propagated` is the motion predicted from previous frames, if there is one.
RobustStart robust_start(const Problem& problem, const std::optional<SE3>& propagated,
                         const RobustStartOptions& options);

// AP3P (Ke & Roumeliotis, CVPR 2017; the paper's reference for its robust start): the motions that map three
// points onto three rays of unit length,
//
//   d_i ray_i = R point_i + t,   d_i > 0 for the correct motion; the caller selects among the solutions.
//
// The cosine of one angle is a root of a quartic; the rest follows without trigonometric functions.
// Degenerate triangles give no solution.

class P3PSolutions {
 public:
  P3PSolutions(const std::array<Eigen::Vector3d, 3>& points, const std::array<Eigen::Vector3d, 3>& rays);
  const SE3* begin() const { return motions_.data(); }
  const SE3* end() const { return motions_.data() + size_; }
  size_t size() const { return size_; }

 private:
  std::array<SE3, 4> motions_;
  size_t size_ = 0;
};

/// Returns the real parts of the roots of x^4 + a[0] x^3 + a[1] x^2 + a[2] x + a[3] (Ferrari), refined by
/// Newton's method.
std::array<double, 4> quartic_roots(const std::array<double, 4>& a);

// ---- Choice of the points that a refinement uses (option pipeline.refine_on), between the robust start
// and the estimator:
//
//   inliers      points within the RANSAC threshold of the start. If the noise exceeds the threshold they are
//                few, and selected for agreement with a motion through three noisy points
//   all          every measurement in front of the camera at the start, outliers included
//   reselected   points that agree with the refined motion, given the noise level of the residuals
//                themselves: those that belong to the core of a mixture of core and outliers
//                (robust_start.cc). The RANSAC threshold then only serves to find a start

enum class RefineOn { inliers, all, reselected };
constexpr Names<3> names_of(RefineOn) { return {"inliers", "all", "reselected"}; }

/// Returns the starting point of the refinement: a motion and the inliers. `start` is that of robust_start();
/// it is returned unchanged for `inliers`, and for `reselected` if the mixture cannot be fitted.
StartingPoint choose_points(const Problem& problem, const StartingPoint& start, RefineOn refine_on);

}  // namespace sextant
