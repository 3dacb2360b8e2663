#pragma once

// Ground truth of KITTI tracking: camera, camera trajectory and object tracks, from the text files only
// (training/{calib,oxts,label_02}/%04d.txt).
//
// Camera poses, relative to the first sample: T_0_k = A P_0^-1 P_k A^-1 with P the devkit's oxts poses and
//
//   ground_truth = rectified:  A = O R_rect Tr_velo_to_cam Tr_imu_to_velo, O = offset of camera 2:
//                              poses of the camera of image_02; object positions are moved by O as well
//   ground_truth = authors:    A = Tr_velo_to_cam Tr_imu_to_velo, as the paper's authors have it in their
//                              pose_gt.txt; object positions as labelled (rectified camera 0)
//
// This truth has errors itself (kitti_oxts.h). The option `velocity` determines the steps between positions
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
// Objects: id = track id + 1 (as in decoded MOTS masks), T_camera_object = (Ry(rotation_y + pi/2), (x, y,
// z)), or the pose in training/object_pose/%04d.txt, an extension of this project, if given there
// (codec/pose_text.h). Rows of type DontCare are no objects.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/base/options.h"
#include "sextant/datasets/dataset.h"
#include "sextant/geometry/camera.h"
#include "sextant/truth/truth.h"

namespace sextant {

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
  SEXTANT_OPTIONS(
      (KittiPoses, ground_truth, KittiPoses::rectified, "",
       "camera poses: rectified = of the camera of image_02; authors = without "
       "rectification and offset, as in the pose_gt.txt of the paper's authors"),
      (KittiVelocity, velocity, KittiVelocity::raw, "",
       "raw = steps between GPS/IMU positions; velocity_corrected = their lengths from the measured speed; "
       "velocity_vector = lengths and directions from the measured velocity; velocity_heading = that "
       "velocity, rotated into the heading of the car"),
      (KittiHeading, heading, KittiHeading::yaw, "",
       "yaw = the attitude as measured; course = its heading rotated slowly into the direction of the "
       "velocity"),
      (double, velocity_lag_s, 0.05, "s",
       "how much older a sample's velocity is than its position, for heading = course and velocity = "
       "velocity_heading"),
      (KittiPair, bf_preset, KittiPair::colour, "",
       "focal length times baseline: colour = of image_02 and "
       "image_03; grey = of the grey pair (the authors' choice)"),
      (double, bf, 0, "px m", "focal length times baseline; 0 = by bf_preset"))
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
