#pragma once

// The multi-body visual odometry pipeline of Zhang et al. (IROS 2020), sections III-IV, on the measurements
// of consecutive frame pairs:
//
//   ego motion (robust start vs. the propagated motion, refinement)  ->  scene flow, dynamic or static  ->
//   gates  ->  labels by majority vote  ->  object motion  ->  velocity
//
// The likelihood test (classification.h) needs the object's motion, which is then estimated before the
// labels. FrameEstimator stores the propagated state: the last camera motion, object motions and labels.
// Pairs must be given in order. The result is a pure function of the pairs and the options.

#include <map>
#include <memory>

#include "sextant/estimator/classification.h"
#include "sextant/estimator/consistency.h"
#include "sextant/estimator/solvers/estimator.h"
#include "sextant/estimator/start/point_choice.h"
#include "sextant/estimator/start/robust_start.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/measurement/problem.h"

namespace sextant {

/// Points on which the motion of an object is refined: those of RefineOn, or (`same`) of the option
/// refine_on.
enum class RefineObjectsOn { inliers, all, reselected, same };
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
  double distance_m = 0;          ///< median depth of the points; NaN without points and for the background
  double moving_share = 0;        ///< share of points with scene flow above the threshold; NaN if unknown
  bool is_dynamic = false;
  std::optional<MotionLikelihood> likelihood;  ///< if classification.test is likelihood
  /// centroid of the inliers, previous camera coordinates
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
  int last_curr_ = 0;  ///< frame number of the state below
  bool has_last_ = false;
  SE3 last_camera_motion_;  ///< T_curr_prev of the background in the last pair
  bool has_camera_motion_ = false;
  std::map<int, int> track_of_instance_;  ///< for the last current frame
  std::map<int, SE3> motion_of_track_;    ///< H in coordinates of the last current camera
  int next_track_ = 1;
};

}  // namespace sextant
