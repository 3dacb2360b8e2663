#pragma once

// Classification of a body as dynamic or static (docs/method.md).
//
// threshold, from scene flow (paper eq. (12)): f = m_prev - T_prev_curr * m_curr per point, with m_curr from
// the current depth at p + phi. An object is dynamic if more than `min_moving_share` of its points move
// faster than `min_speed_mps`. By default the vertical component is ignored, as in the published code: cars
// move on the ground plane, where the vertical scene flow contains only depth noise.
//
// likelihood, from the estimated motion X and the background's motion X_b with their covariances: d = X c -
// X_b c is the displacement of the body's centre c, conditioned on the body not rotating, and S is the
// covariance of d. With r = smallest_speed_mps dt, an object is dynamic if no displacement within r explains
// d (chi2_3: quantile of the chi-square distribution with 3 degrees of freedom):
//
//   min_{|e| <= r} (d - e)^T S^-1 (d - e)  >  chi2_3(1 - false_alarm_rate)
//
// Hence a body slower than smallest_speed_mps is classified dynamic at most at the false alarm rate.

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
      "likelihood: slower bodies count as static (1 cm a frame at 10 Hz, as in Virtual KITTI)");
    v("false_alarm_rate", false_alarm_rate, "probability",
      "likelihood: upper bound on the probability that a body slower than smallest_speed_mps is classified "
      "dynamic");
  }
  void check() const;
};

struct MotionClass {
  double moving_share = 0;  ///< NaN if no point has both depths
  int n_points = 0;         ///< points with both depths
  /// true if moving_share exceeds min_moving_share; also if it is unknown, since nothing shows that the body
  /// stands still
  bool is_dynamic = false;
};

MotionClass classify_motion(const Problem& object, const SE3& T_curr_prev_background, double dt_s,
                            const ClassificationOptions& options);

/// Result of the likelihood test for the displacement of a body against the background.
struct MotionLikelihood {
  double statistic = 0;  ///< square root of the minimum above: standard deviations beyond the smallest speed
  double detectable_mps = 0;  ///< speed that is detected in half of the cases, along the worst direction
  bool is_dynamic = false;
};

/// Returns the result of the likelihood test for a body with the centre `centre_m` (previous camera
/// coordinates); nullopt if the covariance of its motion against the background is not positive definite or a
/// number is not finite.
std::optional<MotionLikelihood> test_motion(const MotionEstimate& body, const MotionEstimate& background,
                                            const Eigen::Vector3d& centre_m, double dt_s,
                                            const ClassificationOptions& options);

}  // namespace sextant
