#pragma once

// Dynamic or static (docs/method.md).
//
// threshold, from scene flow (paper eq. (12)):  f = m_prev - T_prev_curr * m_curr  per point, with m_curr
// from the current depth at p + phi. An object is dynamic when more than `min_moving_share` of its points
// move faster than `min_speed_mps`. The vertical component is left out by default, as in the published code:
// cars move on the ground plane, and the vertical scene flow adds depth noise only.
//
// likelihood, from the estimated motion X and that of the background X_b, with their covariances: d = X c -
// X_b c is the displacement of the body's centre c, given that the body does not turn, and S its covariance.
// With r = smallest_speed_mps dt, an object is dynamic when no displacement within r explains d
// (chi2_3: quantile of the chi-square distribution of 3 degrees of freedom):
//
//   min_{|e| <= r} (d - e)^T S^-1 (d - e)  >  chi2_3(1 - false_alarm_rate)
//
// So a body slower than smallest_speed_mps is called dynamic no more often than at that rate.

#include "sextant/base/names.h"
#include "sextant/base/options.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/measurement/problem.h"

namespace sextant {

enum class MotionTest { threshold, likelihood };
constexpr Names<2> names_of(MotionTest) { return {"threshold", "likelihood"}; }

struct ClassificationOptions {
  MotionTest test = MotionTest::threshold;
  double min_speed_mps = 1.2;
  double min_moving_share = 0.7;
  bool use_vertical = false;
  double smallest_speed_mps = 0.1;
  double false_alarm_rate = 0.001;

  void visit(auto& v) {
    v("test", test, "",
      "threshold: the share of moving points (the paper's); likelihood: whether the covariances explain the "
      "motion");
    v("min_speed_mps", min_speed_mps, "m/s", "scene flow of a moving point (0.12 m per frame at 10 Hz)");
    v("min_moving_share", min_moving_share, "fraction", "a dynamic object has more moving points than this");
    v("use_vertical", use_vertical, "", "use the vertical scene flow too");
    v("smallest_speed_mps", smallest_speed_mps, "m/s",
      "of likelihood: slower bodies count as static (1 cm a frame at 10 Hz, as in Virtual KITTI)");
    v("false_alarm_rate", false_alarm_rate, "probability",
      "of likelihood: of calling one of those dynamic, at most");
  }
  void check() const;
};

struct MotionClass {
  double moving_share = 0;  ///< NaN when no point has both depths
  int n_points = 0;         ///< points with both depths
  bool is_dynamic = false;  ///< true when moving_share is unknown: nothing says that it stands still
};

MotionClass classify_motion(const Problem& object, const SE3& T_curr_prev_background, double dt_s,
                            const ClassificationOptions& options);

/// What the covariances say of a body's displacement against the background.
struct MotionLikelihood {
  double statistic = 0;       ///< root of the minimum above: standard deviations beyond the smallest speed
  double detectable_mps = 0;  ///< speed that is found in half of the cases, along the worst direction
  bool is_dynamic = false;
};

/// None where a covariance is not positive definite. `centre_m`: of the body, previous camera coordinates.
std::optional<MotionLikelihood> test_motion(const MotionEstimate& body, const MotionEstimate& background,
                                            const Eigen::Vector3d& centre_m, double dt_s,
                                            const ClassificationOptions& options);

}  // namespace sextant
