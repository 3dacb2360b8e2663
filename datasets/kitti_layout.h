#pragma once

// Layout `kitti`: writes a sequence in the format of KITTI tracking, including its GPS/IMU samples.
//
// GPS/IMU samples along a camera trajectory, as the receiver in the car would record them: the inverse of
// kitti_truth.h.
//
//   T_map_imu(k) = W T_world_camera(k) T_camera_imu,  W: world axes (x right, y down, z ahead) -> map (x
//   east, y north, z up), then moved so that the first sample lies at 49.011 N, 8.4229 E, 112 m
//
// Sample k is taken at time k / rate + jitter_k, jitter_k normal with mean 0. Between frames, positions
// follow the twice continuously differentiable cubic spline through the poses whose first and last segments
// are parabolas, and rotations have a constant rate from one frame to the next; without jitter the samples
// are the poses of the frames. Speeds are the derivative of the spline at the time of the sample.

#include <cstdint>
#include <vector>

#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/layout.h"

namespace sextant {

struct OxtsJitter {
  double sigma_s = 0;  ///< standard deviation of the sample's time relative to the image's
  uint64_t seed = 1;   ///< the jitter of a frame is a function of (seed, frame) only
};

/// Returns one sample per pose. Values that poses do not determine (accelerations, turn rates, receiver
/// state) are 0.
std::vector<KittiOxts> oxts_of_track(const std::vector<SE3>& T_world_camera, double rate_hz,
                                     const SE3& T_camera_imu, const OxtsJitter& jitter = {});

// Layout `kitti`: writes a sequence in the format of KITTI tracking below OUT/training, with MOTS masks and
// three additions that the data set lacks: depth_02, flow_02 (kitti_tracking.h) and object_pose
// (codec/pose_text.h). Channels that the source lacks are left out.
//
// Frames are numbered from 0 regardless of their numbers in the source, because lines of oxts are not
// numbered. The calibration has R_rect = I and camera 2 = camera 0, so that both values of ground_truth give
// the same poses.
//
// Information that the format does not store:
//   - the world frame: poses come back relative to the first one
//   - roll and pitch of objects, except in object_pose: rotation_y of label_02 is the heading of their z
//     axis; without object_pose an object that is tilted by e against the camera's vertical comes back turned
//     by at most about e (its position is exact)
//   - depth beyond 255.99 m and steps finer than 1/256 m; flow beyond 512 px and steps finer than 1/64 px
//   - backward flow, occlusion, and the `moving` flag of objects
//   - rates other than 10 Hz: an Error

struct KittiLayoutOptions {
  SEXTANT_OPTIONS((double, oxts_jitter_ms, 0, "ms",
                   "standard deviation of the GPS/IMU sample's time against the image (KITTI: about 5)"),
                  (uint64_t, seed, 1, "", "seed of the jitter"))
  void check() const;
};

/// Implements Layout::write of layout.h. Also throws Error for a frame rate other than 10 Hz, a frame without
/// camera pose if others have one, an object without box or size or with blanks in its type, and an id
/// outside 1..1000, the range of MOTS.
std::string write_kitti_layout(const Sequence& sequence, const LayoutRequest& request);

}  // namespace sextant
