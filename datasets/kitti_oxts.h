#pragma once

// Poses of the GPS/IMU unit of KITTI (oxts), and their accuracy as determined from the samples alone:
// difference between heading and course of the car, accuracy of steps and rotations, faults of positions.
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
//
// Positions that contradict the measured speed are a fault of the file. Let s' be the median of |d| / v; a
// step is a fault if | |d| - s' v | exceeds 0.5 m and 10 robust standard deviations (1.4826 times the median)
// of these differences.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/dataset.h"
#include "sextant/geometry/se3.h"

namespace sextant {

inline constexpr double kitti_slow_mps =
    1.0;  ///< slower samples are left out: their speed determines the step too inaccurately

/// Returns v of the step from sample i to sample i + 1.
double kitti_mean_speed_mps(const std::vector<KittiOxts>& samples, size_t i);

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

/// Returns true if a step between samples is faster than kitti_slow_mps.
bool kitti_moves(const std::vector<KittiOxts>& samples);
/// Returns the largest speed (m/s) of the samples.
double kitti_top_speed_mps(const std::vector<KittiOxts>& samples);

/// Returns the first sample in which the speeds by (vn, ve) and by (vf, vl) differ by more than 0.1 m/s (in
/// KITTI they agree to 0.002 m/s), as text for a message; empty if there is none.
std::string kitti_differing_velocities(const std::vector<KittiOxts>& samples,
                                       const std::filesystem::path& path);
/// Returns the faults of the positions as text for a message; empty if there are none. `poses` are
/// kitti_imu_poses(samples).
std::string kitti_position_faults(const std::vector<KittiOxts>& samples, const std::vector<SE3>& poses,
                                  const std::filesystem::path& path);

}  // namespace sextant
