#pragma once

// Ground truth of KITTI tracking: poses from oxts, objects from labels, and the accuracy of the poses.
//
// Difference between heading and course of the car, and accuracy of the truth's steps and rotations, from the
// samples of oxts alone.
//
// A car moves in the direction of its heading, except for a lever arm between the GPS/IMU unit and the point
// without lateral slip. With v_k the horizontal velocity of sample k and w its yaw rate,
//
//   course_k = direction of v_k + lag (v_k+1 - v_k-1) / (2 dt)
//   course_k - yaw_k = lever w_k / |v_k| + slow_k + noise     (rad; counter-clockwise, as yaw)
//
// lag: delay of the receiver's velocities relative to its positions. slow: drift of the course against the
// heading, a random walk of 0.0004 rad per sample. noise: 0.02 m/s across, i.e. 0.02 / |v| rad; samples below
// 1 m/s are not used. The lever (prior: 0 +- 1 m) and slow_k are the least-squares solution, as of a Kalman
// smoother; at 10 m/s the smoother averages over about five samples on either side.
//
// Accuracy of the truth, over the steps between successive samples. d: step of the position; o: step of the
// rotation, as a rotation vector; v: mean speed at both ends of the step; s: mean of |d| / v. Steps with v <=
// 1 m/s have no part in s, step_m and lateral_m, and count as 0 in rotation_timing_deg.
//
//   step_m               rms of |d| - s v
//   lateral_m            rms of the component of d perpendicular to the heading, minus lever times turn
//   rotation_deg         rms of |o - s w|, w = mean turn rate (wx wy wz) at both ends
//   rotation_timing_deg  rms of |o| ||d| / (s v) - 1|: effect of samples taken off the times of the images
//
// rotation_deg contains the errors of the attitude and of the turn rates, so it is an upper bound;
// rotation_timing_deg is a lower bound.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/base/options.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/dataset.h"
#include "sextant/geometry/camera.h"
#include "sextant/truth/truth.h"

namespace sextant {

inline constexpr double kitti_slow_mps =
    1.0;  ///< slower samples are left out: their speed determines the step too inaccurately

/// Returns the poses of the GPS/IMU unit in map axes (x east, y north, z up); `samples` must not be empty.
/// Longitudes that differ from the first one by more than 180 degrees are continued across +-180 degrees.
std::vector<SE3> kitti_imu_poses(const std::vector<KittiOxts>& samples);

/// Comparison of the steps of a trajectory with the measured speed; see step_m above.
struct StepFloor {
  int n_steps = 0;     ///< number of steps with v > 1 m/s
  double mean_s = 0;   ///< s: mean of |d| / v
  double floor_m = 0;  ///< rms of |d| - mean_s v
  /// rms of the component of the steps perpendicular to the mean velocity at their ends
  double across_m = 0;
};
/// Returns the comparison; nullopt if no step is faster than 1 m/s, or if the positions do not change.
std::optional<StepFloor> kitti_step_floor(const std::vector<KittiOxts>& samples);

struct CourseFit {
  std::vector<double> slow_rad;            ///< slow_k, by sample
  double lever_m = 0;                      ///< position of the unit ahead of the point without lateral slip
  double lowest_deg = 0, highest_deg = 0;  ///< extremes of slow_rad
};
/// Fits lever and drift; `step_s` is the time between samples. nullopt if no sample is faster than 1 m/s.
std::optional<CourseFit> kitti_course(const std::vector<KittiOxts>& samples, double step_s, double lag_s);

/// Returns all accuracies except step_m for the poses `imu`, which were made of `samples` and may have been
/// corrected. rotation_deg and gyro_deg are nullopt if all turn rates are 0, as in files without them.
TruthFloor kitti_pose_floor(const std::vector<SE3>& imu, const std::vector<KittiOxts>& samples,
                            const StepFloor& steps, double lever_m);

// Camera, camera trajectory and object tracks of a KITTI tracking sequence, from its text files only
// (training/{calib,oxts,label_02}/%04d.txt).
//
// Camera poses, relative to the first sample: T_0_k = A P_0^-1 P_k A^-1 with P the devkit's oxts poses and
//
//   ground_truth = rectified:  A = O R_rect Tr_velo_to_cam Tr_imu_to_velo, O = offset of camera 2:
//                              poses of the camera of image_02; object positions are moved by O as well
//   ground_truth = authors:    A = Tr_velo_to_cam Tr_imu_to_velo, as the paper's authors have it in their
//                              pose_gt.txt; object positions as labelled (rectified camera 0)
//
// This truth has errors itself (see above). The option `velocity` determines the steps between positions
// where v > 1 m/s, with v the mean speed at their ends and d their length:
//
//   raw                 unchanged; their lengths jitter, since samples are not taken exactly at the images
//   velocity_corrected  length mean(d / v) v; unchanged direction, which still contains the corrections of
//                       positions by the receiver
//   velocity_vector     mean(d / v) times the mean velocity (east, north, up) at their ends
//   velocity_heading    the same velocity, taken velocity_lag_s later and rotated by the slow drift between
//                       course and heading, so that the car moves in the direction of its heading
//
// heading = course rotates the attitude instead, by the same slow drift, so that the heading follows the
// velocity; velocity_vector then also uses velocities taken velocity_lag_s later.
//
// Positions that contradict the measured speed are a fault of the file. Let s' be the median of |d| / v; a
// step is a fault if | |d| - s' v | exceeds 0.5 m and 10 robust standard deviations (1.4826 times the median)
// of these differences.
//
// Objects: id = track id + 1 (as in decoded MOTS masks), T_camera_object = (Ry(rotation_y + pi/2), (x, y,
// z)), or the pose in training/object_pose/%04d.txt, an extension of this project, if given there
// (codec/pose_text.h). Rows of type DontCare are no objects.

enum class KittiPoses { rectified, authors };
constexpr Names<2> names_of(KittiPoses) { return {"rectified", "authors"}; }
enum class KittiVelocity { raw, velocity_corrected, velocity_vector, velocity_heading };
constexpr Names<4> names_of(KittiVelocity) {
  return {"raw", "velocity_corrected", "velocity_vector", "velocity_heading"};
}
enum class KittiHeading { yaw, course };
constexpr Names<2> names_of(KittiHeading) { return {"yaw", "course"}; }
enum class KittiPair { colour, grey };
constexpr Names<2> names_of(KittiPair) { return {"colour", "grey"}; }

struct KittiTruthOptions {
  KittiPoses ground_truth = KittiPoses::rectified;
  KittiVelocity velocity = KittiVelocity::raw;
  KittiHeading heading = KittiHeading::yaw;
  double velocity_lag_s = 0.05;
  KittiPair bf_preset = KittiPair::colour;
  double bf = 0;

  template <typename V>
  void visit(V& v) {
    v("ground_truth", ground_truth, "",
      "camera poses: rectified = of the camera of image_02; authors = without "
      "rectification and offset, as in the pose_gt.txt of the paper's authors");
    v("velocity", velocity, "",
      "raw = steps between GPS/IMU positions; velocity_corrected = their lengths from the measured speed; "
      "velocity_vector = lengths and directions from the measured velocity; velocity_heading = that "
      "velocity, rotated into the heading of the car");
    v("heading", heading, "",
      "yaw = the attitude as measured; course = its heading rotated slowly into the direction of the "
      "velocity");
    v("velocity_lag_s", velocity_lag_s, "s",
      "how much older a sample's velocity is than its position, for heading = course and velocity = "
      "velocity_heading");
    v("bf_preset", bf_preset, "",
      "focal length times baseline: colour = of image_02 and "
      "image_03; grey = of the grey pair (the authors' choice)");
    v("bf", bf, "px m", "focal length times baseline; 0 = by bf_preset");
  }
  void check() const;
};

struct KittiTruth {
  StereoCamera camera;
  SequenceTruth truth;  ///< all frames of the files
  TruthFloor floor;
  int n_poses = 0;  ///< number of samples in oxts; 0 = there is no such file
  std::optional<int> last_labelled_frame;
  std::vector<std::string> warnings;
  std::vector<std::string> faults;  ///< warnings that say that the camera poses are wrong
  std::vector<std::string> provenance;
  std::vector<std::string> accuracy;  ///< lines of the provenance on the accuracy of the camera poses
};

/// Reads the truth; `root` is the folder that contains training/. Missing oxts or labels, and faults of the
/// positions in oxts, are warnings. Throws Error if training/calib or the sequence's calibration is missing,
/// if a file is malformed or does not fit the others, and if the options require velocities that agree and
/// they differ, or positions that change and they do not.
KittiTruth read_kitti_truth(const std::filesystem::path& root, const std::string& sequence,
                            const KittiTruthOptions& options, InputLog& inputs);

/// Size of the sequence's images (px) according to its MOTS text; the usual size if there is none.
struct KittiImageSize {
  int width = 1242;
  int height = 375;
  bool is_known = false;
};
KittiImageSize kitti_image_size(const std::filesystem::path& root, const std::string& sequence,
                                InputLog& inputs);

}  // namespace sextant
