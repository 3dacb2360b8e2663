#pragma once

// GPS/IMU samples of KITTI (oxts/%04d.txt): one line of 30 values per frame, the sample nearest to the image.
//
//   pose (the devkit's convertOxtsToPose): T_world_imu = (Rz(yaw) Ry(pitch) Rx(roll), t),
//     t = (s r lon pi/180,  s r ln tan((90 + lat) pi/360),  alt)   (m; Mercator, x east, y north, z up)
//     r = 6378137 m, s = cos(latitude of the sequence's first sample)
//   imu: x ahead, y left, z up
//   velocity: vn, ve, vu by the compass; vf, vl ahead and left, parallel to the ground too, not to the imu
//
// Source: the raw data development kit (Geiger et al., IJRR 2013).

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/geometry/se3.h"

namespace sextant {

struct KittiOxts {
  double latitude_deg = 0;
  double longitude_deg = 0;
  double altitude_m = 0;
  double roll_rad = 0;
  double pitch_rad = 0;
  double yaw_rad = 0;                     ///< 0 = east, counter-clockwise
  double north_mps = 0;                   ///< vn
  double east_mps = 0;                    ///< ve
  Eigen::Vector3d velocity_mps{0, 0, 0};  ///< vf vl vu: ahead, left, up; turned by yaw only
  std::array<double, 19> rest{};  ///< accelerations, turn rates, accuracies and receiver state, as they are

  /// East, north, up: the axes of the positions.
  Eigen::Vector3d map_velocity_mps() const { return {east_mps, north_mps, velocity_mps.z()}; }
};

/// By frame number 0, 1, ... Throws Error "NAME:LINE: ..." on another number of values than 30, values that
/// are not finite, a latitude outside (-90, 90) or a longitude outside [-180, 180]; "NAME: ..." when empty.
std::vector<KittiOxts> decode_kitti_oxts(std::string_view text, const std::string& name);

/// 17 significant digits: reads back as the same numbers.
std::string encode_kitti_oxts(const std::vector<KittiOxts>& samples);

/// s above.
double mercator_scale(double first_latitude_deg);

SE3 pose_from_oxts(const KittiOxts& sample, double scale);

/// The inverse; velocities are left 0. Angles: roll and yaw in (-pi, pi], pitch in [-pi/2, pi/2].
KittiOxts oxts_from_pose(const SE3& T_world_imu, double scale);

}  // namespace sextant
