#pragma once

// Text files of KITTI tracking: calibration, labels and GPS/IMU samples (oxts).
//
// Calibration of a KITTI tracking sequence (calib/%04d.txt): one key and its numbers per line, row by row.
//
//   P0 P1 P2 P3      3x4, rectified camera 0 -> pixels of camera i (px, px m); 0, 1 grey, 2, 3 colour,
//                    0 and 2 left, 1 and 3 right
//   rectification    3x3, camera 0 -> rectified camera 0
//   velo_to_cam      3x4, laser scanner -> camera 0 (m)
//   imu_to_velo      3x4, GPS/IMU unit -> laser scanner (m)
//
// Two dialects are in use, each with or without a colon after a key:
//
//   tracking   R_rect   Tr_velo_cam     Tr_imu_velo
//   object     R0_rect  Tr_velo_to_cam  Tr_imu_to_velo
//
// Source: the data set's development kits (Geiger et al., CVPR 2012).

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/image.h"

namespace sextant {

struct KittiCalibration {
  using Matrix34d = Eigen::Matrix<double, 3, 4>;

  std::array<Matrix34d, 4> P;
  Eigen::Matrix3d R_rect = Eigen::Matrix3d::Identity();
  Matrix34d Tr_velo_to_cam = Matrix34d::Identity();
  Matrix34d Tr_imu_to_velo = Matrix34d::Identity();

  /// Returns the intrinsics of camera i.
  PinholeCamera camera(size_t i) const;
  /// Returns the position of rectified camera 0 in camera i: p_i = p_0 + offset (m); K_i^-1 times the last
  /// column of P_i.
  Eigen::Vector3d offset_m(size_t i) const;
  /// Return focal length times baseline (px m): P2(0,3) - P3(0,3), and P0(0,3) - P1(0,3).
  double colour_bf() const { return P[2](0, 3) - P[3](0, 3); }
  double grey_bf() const { return P[0](0, 3) - P[1](0, 3); }
};

/// Decodes a calibration. Throws Error "NAME:LINE: ..." on an unknown or repeated key, another number of
/// values, values that are not finite, a matrix that is not a projection or not a rigid motion, and on a mix
/// of dialects; Error "NAME: ..." on a missing key, with its spellings.
KittiCalibration decode_kitti_calibration(std::string_view text, const std::string& name);

/// Encodes with 17 significant digits, in the dialect of the tracking benchmark or, with `object_dialect`, in
/// that of the object benchmark.
std::string encode_kitti_calibration(const KittiCalibration& calibration, bool object_dialect = false);

// Object labels of KITTI tracking (label_02/%04d.txt), 17 columns:
//
//   frame track_id type truncated occluded alpha
//   left top right bottom  height width length  x y z rotation_y
//
// Boxes in px; sizes and positions in m; (x, y, z) is the middle of the box's bottom face in rectified camera
// 0; angles in rad, rotation_y about the camera's y axis, 0 = heading along +x. Rows of type DontCare have
// track id -1 and no pose.

struct KittiLabel {
  int frame = 0;
  int track_id = -1;
  std::string type;
  double truncated = 0;
  int occluded = 0;
  double alpha_rad = 0;
  ImageBox box;
  double height_m = 0, width_m = 0, length_m = 0;
  Eigen::Vector3d position_m{0, 0, 0};
  double rotation_y_rad = 0;

  bool dont_care() const { return type == "DontCare"; }
};

/// Decodes labels in the order of the file. Throws Error "NAME:LINE: ..." on another number of columns,
/// values that are not finite, frames outside 0..9999999, (except DontCare) track ids outside 0..65534 or
/// sizes that are not positive, and a track that is repeated in a frame.
std::vector<KittiLabel> decode_kitti_labels(std::string_view text, const std::string& name);

/// Encodes labels with 17 significant digits for the pose; boxes and sizes to 1e-6.
std::string encode_kitti_labels(const std::vector<KittiLabel>& labels);

// GPS/IMU samples of KITTI (oxts/%04d.txt): one line of 30 values per frame, the sample nearest to the image.
//
//   pose (the devkit's convertOxtsToPose): T_world_imu = (Rz(yaw) Ry(pitch) Rx(roll), t),
//     t = (s r lon pi/180,  s r ln tan((90 + lat) pi/360),  alt)   (m; Mercator, x east, y north, z up)
//     r = 6378137 m, s = cos(latitude of the sequence's first sample)
//   imu: x ahead, y left, z up
//   velocity: vn, ve, vu along north, east, up; vf, vl ahead and left in the horizontal plane, that is,
//     rotated by yaw only and not by the roll and pitch of the imu
//
// Source: the raw data development kit (Geiger et al., IJRR 2013).

struct KittiOxts {
  double latitude_deg = 0;
  double longitude_deg = 0;
  double altitude_m = 0;
  double roll_rad = 0;
  double pitch_rad = 0;
  double yaw_rad = 0;                     ///< 0 = east, counter-clockwise
  double north_mps = 0;                   ///< vn
  double east_mps = 0;                    ///< ve
  Eigen::Vector3d velocity_mps{0, 0, 0};  ///< vf vl vu: ahead, left, up; rotated by yaw only
  std::array<double, 19> rest{};  ///< accelerations, turn rates, accuracies and receiver state, unchanged

  /// Returns the velocity in the axes of the positions: east, north, up.
  Eigen::Vector3d map_velocity_mps() const { return {east_mps, north_mps, velocity_mps.z()}; }
};

/// Decodes samples, by frame number 0, 1, ... Throws Error "NAME:LINE: ..." on another number of values than
/// 30, values that are not finite, a latitude outside (-90, 90) or a longitude outside [-180, 180]; "NAME:
/// ..." for an empty file.
std::vector<KittiOxts> decode_kitti_oxts(std::string_view text, const std::string& name);

/// Encodes with 17 significant digits, which read back as the same numbers.
std::string encode_kitti_oxts(const std::vector<KittiOxts>& samples);

/// Returns the Mercator scale s defined above.
double mercator_scale(double first_latitude_deg);

SE3 pose_from_oxts(const KittiOxts& sample, double scale);

/// Returns the sample with this pose, the inverse of pose_from_oxts(); its other values are 0. Angles: roll
/// and yaw in (-pi, pi], pitch in [-pi/2, pi/2].
KittiOxts oxts_from_pose(const SE3& T_world_imu, double scale);

}  // namespace sextant
