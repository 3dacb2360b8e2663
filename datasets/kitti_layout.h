#pragma once

// Layout `kitti`: writes a sequence as KITTI tracking has it, with its GPS/IMU samples.
//
// GPS/IMU samples along a camera trajectory, as the receiver in a car would give them: the inverse of what
// kitti_truth.h does.
//
//   T_map_imu(k) = W T_world_camera(k) T_camera_imu,  W: world axes (x right, y down, z ahead) -> map (x
//   east, y north, z up), then moved so that the first sample lies at 49.011 N, 8.4229 E, 112 m
//
// Sample k is taken at k / rate + jitter_k, jitter_k normal with mean 0. Between frames, positions follow
// cubic Hermite curves with central differences as slopes, rotations turn at a constant rate; without jitter
// the samples are the frames' own poses. Speeds are the curve's derivative at the time of the sample.

#include <cstdint>
#include <vector>

#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/layout.h"

namespace sextant {

struct OxtsJitter {
  double sigma_s = 0;  ///< standard deviation of the sample's time against the image's
  uint64_t seed = 1;   ///< the draw of a frame is a function of (seed, frame) alone
};

/// One sample per pose. Values that the poses do not tell (accelerations, turn rates, receiver state) are 0.
std::vector<KittiOxts> oxts_of_track(const std::vector<SE3>& T_world_camera, double rate_hz,
                                     const SE3& T_camera_imu, const OxtsJitter& jitter = {});

// Layout `kitti`: writes a sequence as KITTI tracking has them, below OUT/training, with MOTS masks and,
// beside what that data set has, depth_02 and flow_02 (kitti_tracking.h). Channels that the source lacks are
// left out.
//
// Frames are numbered from 0, whatever their numbers in the source: a line of oxts has no number. The
// calibration has R_rect = I and camera 2 = camera 0, so that both choices of ground_truth mean the same
// poses.
//
// What the format does not keep:
//   - the world frame: poses come back relative to the first one
//   - roll and pitch of objects: rotation_y is the heading of their z axis; an object that is tilted by e
//     against the camera's vertical comes back turned by at most about e (position is exact)
//   - depth beyond 255.99 m and steps finer than 1/256 m; flow beyond 512 px and steps finer than 1/64 px
//   - rates other than 10 Hz: an Error

struct KittiLayoutOptions {
  SEXTANT_OPTIONS(
      (double, oxts_jitter_ms, 0, "ms",
       "standard deviation of the GPS/IMU sample's time against the image (KITTI: about 5)"),
      (uint64_t, seed, 1, "", "of the jitter"))
  void check() const;
};

/// As layout.h says. Also throws Error on a frame without camera pose when others have one, an object without
/// box or size, or ids that MOTS cannot hold.
std::string write_kitti_layout(const Sequence& sequence, const LayoutRequest& request);

}  // namespace sextant
