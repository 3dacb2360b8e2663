#pragma once

// The multi-body visual odometry pipeline of Zhang et al. (IROS 2020), sections III-IV, on the measurements
// of consecutive frame pairs:
//
//   ego motion (robust start vs. the propagated motion, refinement)  ->  scene flow, dynamic or static  ->
//   gates  ->  labels by majority vote  ->  object motion  ->  velocity
//
// The likelihood test (test_motion()) needs the object's motion, which is then estimated before the
// labels. FrameEstimator stores the propagated state: the last camera motion, object motions and labels.
// Pairs must be given in order. The result depends only on the pairs given so far and the options.

#include <map>
#include <memory>
#include <optional>

#include "sextant/base/names.h"
#include "sextant/base/options.h"
#include "sextant/estimator/consistency.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/estimator/start/robust_start.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/measurement/problem.h"

namespace sextant {

// ---- Classification of a body as dynamic or static (docs/method.md).
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

enum class MotionTest { threshold, likelihood };
constexpr Names<2> names_of(MotionTest) { return {"threshold", "likelihood"}; }

struct ClassificationOptions {
  SEXTANT_OPTIONS(
      (MotionTest, test, MotionTest::threshold, "",
       "threshold: the share of moving points (the paper's); likelihood: whether the covariances explain the "
       "motion"),
      (double, min_speed_mps, 1.2, "m/s", "scene flow of a moving point (0.12 m per frame at 10 Hz)"),
      (double, min_moving_share, 0.7, "fraction", "a dynamic object has more moving points than this"),
      (bool, use_vertical, false, "", "use the vertical scene flow too"),
      (double, smallest_speed_mps, 0.1, "m/s",
       "likelihood: slower bodies count as static (1 cm a frame at 10 Hz, as in Virtual KITTI)"),
      (double, false_alarm_rate, 0.001, "probability",
       "likelihood: upper bound on the probability that a body slower than smallest_speed_mps is classified "
       "dynamic"))
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

// ---- The pipeline

/// Points on which the motion of an object is refined: those of RefineOn, or (`same`) of the option
/// refine_on.
enum class RefineObjectsOn { inliers, all, reselected, same };
static_assert(static_cast<int>(RefineObjectsOn::inliers) == static_cast<int>(RefineOn::inliers) &&
              static_cast<int>(RefineObjectsOn::all) == static_cast<int>(RefineOn::all) &&
              static_cast<int>(RefineObjectsOn::reselected) == static_cast<int>(RefineOn::reselected));
constexpr Names<4> names_of(RefineObjectsOn) { return {"inliers", "all", "reselected", "same"}; }

struct PipelineOptions {
  SEXTANT_OPTIONS(
      (RobustStartOptions, start, {}, "", "RANSAC against the propagated motion"),
      (RefineOn, refine_on, RefineOn::reselected, "",
       "points on which motion_only and joint_flow refine (joint_flow_depth, and any estimator with robust = "
       "geman_mcclure_gnc, chooses by itself): the inliers of RANSAC, all, or those within the noise level "
       "estimated from the residuals"),
      (RefineObjectsOn, refine_objects_on, RefineObjectsOn::same, "",
       "refine_on for objects; same: as for the background"),
      (ClassificationOptions, classification, {}, "", "dynamic or static"),
      (double, max_object_distance_m, 25.0, "m",
       "gate on the median depth of an object, and farthest object point (paper: 25)"),
      (double, min_object_area, 0.005, "fraction of the image", "gate on an object's area (paper: 0.005)"),
      (int, min_object_points, 30, "count", "fewest points and fewest inliers of an object"),
      (bool, estimate_static_objects, false, "", "also estimate objects classified static"),
      (bool, consistency, false, "",
       "also estimate every body from two halves of its inliers, and from its flow alone (consistency.h)"))
  void check() const;
};

/// Wall-clock times of one body, ms.
struct BodyTimes {
  double start_ms = 0;
  double refine_ms = 0;
  double other_ms = 0;
  double total_ms() const { return start_ms + refine_ms + other_ms; }
};

/// Result of one body in one frame pair. The background has instance 0.
struct BodyResult {
  int instance = 0;
  int track = 0;  ///< label of the tracker: 0 = background or static, 1.. = moving objects
  Status status = Status::ok;
  Gate gate = Gate::none;
  Correspondences points;                 ///< all points from which the body is estimated
  std::optional<MeasurementNoise> noise;  ///< declared noise of these points
  MotionEstimate estimate;                ///< valid if status == ok
  int n_points = 0;
  int n_inliers = 0;              ///< number of inliers of the robust start
  bool start_propagated = false;  ///< the propagated motion had at least as many inliers as RANSAC's
  double area_fraction = 0;       ///< share of the image; NaN for the background
  /// upper median of the depths of all points observed on the object, also beyond max_object_distance_m; NaN
  /// without points and for the background
  double distance_m = 0;
  double moving_share = 0;  ///< share of points with scene flow above the threshold; NaN if unknown
  bool is_dynamic = false;
  std::optional<MotionLikelihood> likelihood;  ///< if classification.test is likelihood
  /// centroid of the points that the refinement used, previous camera coordinates
  Eigen::Vector3d centroid_m = Eigen::Vector3d::Zero();
  double speed_mps = 0;                   ///< |t - (I - R) c| / dt; NaN if not estimated
  SplitNees split;                        ///< if pipeline.consistency is set
  std::optional<ExpansionGap> expansion;  ///< likewise, for objects only
  BodyTimes times;
};

struct FrameResult {
  int prev = 0;
  int curr = 0;
  double dt_s = 0;
  BodyResult ego;
  std::vector<BodyResult> objects;  ///< every instance of either frame, ordered by id
};

/// Returns the points of one instance of the previous mask within `max_depth_m`. Points of other instances
/// belong to a body that disappears behind this one, so that their flow ends on it.
Correspondences points_of_instance(const ObjectObservation& object, int instance, double max_depth_m);

class FrameEstimator {
 public:
  FrameEstimator(const PipelineOptions& options, std::shared_ptr<const Estimator> estimator);
  FrameResult process(const FramePair& pair);

 private:
  BodyResult estimate_ego(const FramePair& pair) const;
  void check_consistency(const FramePair& pair, BodyResult& body) const;
  BodyResult gate_and_classify(const FramePair& pair, const ObjectObservation& object,
                               const BodyResult& ego) const;
  std::map<int, int> associate(const FramePair& pair, const std::vector<BodyResult>& objects);
  void decide_by_likelihood(const FramePair& pair, const BodyResult& ego, BodyResult& body) const;
  void estimate_object(const FramePair& pair, const BodyResult& ego, BodyResult& body) const;
  void refine_object(const FramePair& pair, const std::optional<SE3>& propagated, const BodyResult& ego,
                     BodyResult& body) const;

  PipelineOptions options_;
  std::shared_ptr<const Estimator> estimator_;
  std::optional<int> last_curr_;          ///< frame number of the state below
  std::optional<SE3> background_motion_;  ///< T_curr_prev of the background in the last pair
  std::map<int, int> track_of_instance_;  ///< for the last current frame
  std::map<int, SE3> motion_of_track_;    ///< H in coordinates of the last current camera
  int next_track_ = 1;
};

}  // namespace sextant
