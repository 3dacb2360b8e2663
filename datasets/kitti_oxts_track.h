#pragma once

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

#include "sextant/datasets/codec/kitti_oxts.h"

namespace sextant {

struct OxtsJitter {
  double sigma_s = 0;  ///< standard deviation of the sample's time against the image's
  uint64_t seed = 1;   ///< the draw of a frame is a function of (seed, frame) alone
};

/// One sample per pose. Values that the poses do not tell (accelerations, turn rates, receiver state) are 0.
std::vector<KittiOxts> oxts_of_track(const std::vector<SE3>& T_world_camera, double rate_hz,
                                     const SE3& T_camera_imu, const OxtsJitter& jitter = {});

}  // namespace sextant
