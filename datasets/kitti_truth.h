#pragma once

// Ground truth of KITTI tracking: poses from oxts, objects from labels, and how accurate both are.
//
// The heading of a car against its course, and how good the truth's steps and rotations are: from the samples
// of oxts alone.
//
// A car goes where it points, but for a lever arm between the GPS/IMU unit and the point that does not slip
// sideways. With v_k the horizontal velocity of sample k and w its yaw rate,
//
//   course_k = direction of v_k + lag (v_k+1 - v_k-1) / (2 dt)
//   course_k - yaw_k = lever w_k / |v_k| + slow_k + noise     (rad; counter-clockwise, as yaw)
//
// lag: the receiver's velocities are older than its positions. slow: what one of the two drifts, a random
// walk of 0.0004 rad a sample. noise: 0.02 m/s across, so 0.02 / |v| rad; samples below 1 m/s say nothing.
// Lever (prior: 0 +- 1 m) and slow are the least-squares solution, that of a Kalman smoother: five samples
// count on either side at 10 m/s.
//
// Floors of the truth, over the steps between successive samples, d = position step, o = rotation step:
//   step_m               rms of d - mean(d / v) v, v = mean speed at both ends, where v > 1 m/s
//   lateral_m            rms of the part of d across the heading, less lever times turn, where v > 1 m/s
//   rotation_deg         rms angle between o and the mean turn rates (wx wy wz) at its ends times mean(d / v)
//   rotation_timing_deg  rms of |o| |d / (mean(d / v) v) - 1|: a sample is not taken exactly at its image
// rotation_deg holds the error of both sides, so it is an upper bound; rotation_timing_deg is a lower one.

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

inline constexpr double kitti_slow_mps = 1.0;  ///< below, speed says nothing about a step

/// Poses of the GPS/IMU unit, map axes.
std::vector<SE3> kitti_imu_poses(const std::vector<KittiOxts>& samples);

/// Steps of a trajectory against the measured speed; step_m above.
struct StepFloor {
  int n_steps = 0;      ///< with v > 1 m/s
  double mean_s = 0;    ///< mean of d / v
  double floor_m = 0;   ///< rms of d - mean_s v
  double across_m = 0;  ///< rms of the steps' parts at right angles to the mean velocity at their ends
};
/// Empty when no step is faster than 1 m/s.
std::optional<StepFloor> kitti_step_floor(const std::vector<KittiOxts>& samples);

struct CourseFit {
  std::vector<double> slow_rad;            ///< by sample
  double lever_m = 0;                      ///< the unit's, ahead of the point that does not slip
  double lowest_deg = 0, highest_deg = 0;  ///< of slow
};
/// `step_s`: time between samples. Empty when no sample is faster than 1 m/s.
std::optional<CourseFit> kitti_course(const std::vector<KittiOxts>& samples, double step_s, double lag_s);

/// All but step_m, of poses that were made of these samples. Without turn rates in the file (all 0 although
/// the unit turns) there is no rotation_deg.
TruthFloor kitti_pose_floor(const std::vector<SE3>& imu, const std::vector<KittiOxts>& samples,
                            const StepFloor& steps, double lever_m);

// Camera, camera trajectory and object tracks of a KITTI tracking sequence from its text files alone
// (training/{calib,oxts,label_02}/%04d.txt).
//
// Camera poses, relative to the first sample: T_0_k = A P_0^-1 P_k A^-1 with P the devkit's oxts poses and
//
//   ground_truth = rectified:  A = O R_rect Tr_velo_to_cam Tr_imu_to_velo, O = offset of camera 2:
//                              poses of the camera of image_02; object positions are moved by O as well
//   ground_truth = authors:    A = Tr_velo_to_cam Tr_imu_to_velo, as the paper's authors have it in their
//                              pose_gt.txt; object positions as labelled (rectified camera 0)
//
// That truth errs itself (see the heading, above). velocity says what becomes of the steps between positions,
// where v > 1 m/s, v the mean speed at their ends and d their length:
//
//   raw                 as they are; their lengths jitter, since a sample is not taken exactly at its image
//   velocity_corrected  as long as mean(d / v) v; the receiver's position corrections stay in their
//   directions velocity_vector     mean(d / v) times the mean velocity (east, north, up) at their ends
//   velocity_heading    the same velocity, taken velocity_lag_s later and turned by what course and heading
//                       slowly differ: it goes where the car points
//
// heading = course turns the attitude instead, by the same slow difference, so that the car points where its
// velocity goes; velocity_vector's velocities are then taken velocity_lag_s later as well.
//
// Objects: id = track id + 1 (that of the MOTS masks), T_camera_object = (Ry(rotation_y + pi/2), (x, y, z)),
// or that of training/object_pose/%04d.txt where it is given there (codec/pose_text.h): our extension.

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
      "velocity, "
      "turned to where the car points");
    v("heading", heading, "",
      "yaw = the attitude as measured; course = its heading turned to where the velocity goes, slowly");
    v("velocity_lag_s", velocity_lag_s, "s",
      "how much older a sample's velocity is than its position, for heading = course and velocity = "
      "velocity_heading");
    v("bf_preset", bf_preset, "",
      "focal length times baseline: colour = that of image_02 and "
      "image_03; grey = of the grey pair (the authors' choice)");
    v("bf", bf, "px m", "focal length times baseline; 0 = by bf_preset");
  }
  void check() const;
};

struct KittiTruth {
  StereoCamera camera;
  SequenceTruth truth;  ///< all frames of the files
  TruthFloor floor;
  int n_poses = 0;  ///< samples in oxts; 0 = there is no such file
  std::optional<int> last_labelled_frame;
  std::vector<std::string> warnings;
  std::vector<std::string> provenance;
};

/// `root` holds training/. Throws Error on a folder or calibration that is not there or files that are not as
/// described; missing oxts or labels are warnings.
KittiTruth read_kitti_truth(const std::filesystem::path& root, const std::string& sequence,
                            const KittiTruthOptions& options, InputLog& inputs);

/// Size of the sequence's images in pixels, as its MOTS text has it; usual size when that is not there.
struct KittiImageSize {
  int width = 1242;
  int height = 375;
  bool is_known = false;
};
KittiImageSize kitti_image_size(const std::filesystem::path& root, const std::string& sequence,
                                InputLog& inputs);

}  // namespace sextant
