#pragma once

// The heading of a car against its course, and how good the truth's steps and rotations are: from the samples
// of oxts alone.
//
// A car goes where it points, but for a lever arm between the GPS/IMU unit and the point that does not slip
// sideways. With v_k the horizontal velocity of sample k and w its yaw rate,
//
//   course_k = direction of v_k + lag (v_k+1 - v_k-1) / (2 dt)
//   course_k - yaw_k = lever w_k / |v_k| + slow_k + noise     (rad; counter-clockwise, as yaw)
//
// lag: the receiver's velocities are older than its positions. slow: what one of the two drifts, a random walk
// of 0.0004 rad a sample. noise: 0.02 m/s across, so 0.02 / |v| rad; samples below 1 m/s say nothing. Lever
// (prior: 0 +- 1 m) and slow are the least-squares solution, that of a Kalman smoother: five samples count on either side at 10 m/s.
//
// Floors of the truth, over the steps between successive samples, d = position step, o = rotation step:
//   step_m               rms of d - mean(d / v) v, v = mean speed at both ends, where v > 1 m/s
//   lateral_m            rms of the part of d across the heading, less lever times turn, where v > 1 m/s
//   rotation_deg         rms angle between o and the mean turn rates (wx wy wz) at its ends times mean(d / v)
//   rotation_timing_deg  rms of |o| |d / (mean(d / v) v) - 1|: a sample is not taken exactly at its image
// rotation_deg holds the error of both sides, so it is an upper bound; rotation_timing_deg is a lower one.

#include <optional>
#include <vector>

#include "sextant/datasets/codec/kitti_oxts.h"
#include "sextant/datasets/truth_floor.h"

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
  std::vector<double> slow_rad;  ///< by sample
  double lever_m = 0;            ///< the unit's, ahead of the point that does not slip
  double lowest_deg = 0, highest_deg = 0;  ///< of slow
};
/// `step_s`: time between samples. Empty when no sample is faster than 1 m/s.
std::optional<CourseFit> kitti_course(const std::vector<KittiOxts>& samples, double step_s, double lag_s);

/// All but step_m, of poses that were made of these samples. Without turn rates in the file (all 0 although
/// the unit turns) there is no rotation_deg.
TruthFloor kitti_pose_floor(const std::vector<SE3>& imu, const std::vector<KittiOxts>& samples,
                            const StepFloor& steps, double lever_m);

}  // namespace sextant
