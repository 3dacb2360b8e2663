#pragma once

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

#include "sextant/geometry/camera.h"

namespace sextant {

struct KittiCalibration {
  using Matrix34d = Eigen::Matrix<double, 3, 4>;

  std::array<Matrix34d, 4> P;
  Eigen::Matrix3d R_rect = Eigen::Matrix3d::Identity();
  Matrix34d Tr_velo_to_cam = Matrix34d::Identity();
  Matrix34d Tr_imu_to_velo = Matrix34d::Identity();

  /// Intrinsics of camera i.
  PinholeCamera camera(size_t i) const;
  /// Where rectified camera 0 lies in camera i: p_i = p_0 + offset (m); K_i^-1 times the last column of P_i.
  Eigen::Vector3d offset_m(size_t i) const;
  /// Focal length times baseline (px m): P2(0,3) - P3(0,3), and P0(0,3) - P1(0,3).
  double colour_bf() const { return P[2](0, 3) - P[3](0, 3); }
  double grey_bf() const { return P[0](0, 3) - P[1](0, 3); }
};

/// Throws Error "NAME:LINE: ..." on an unknown or repeated key, another number of values, values that are not
/// finite, a matrix that is no projection or no rigid motion, and on a mix of dialects; Error "NAME: ..." on
/// a missing key, with its spellings.
KittiCalibration decode_kitti_calibration(std::string_view text, const std::string& name);

/// 17 significant digits, in the dialect of the tracking benchmark or, `object_dialect`, the other.
std::string encode_kitti_calibration(const KittiCalibration& calibration, bool object_dialect = false);

}  // namespace sextant
