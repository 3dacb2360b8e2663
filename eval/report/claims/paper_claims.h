#pragma once

// The claims that are checked (claim.h), by what they are checked on.

#include <span>
#include <string>
#include <vector>

#include "sextant/eval/report/claims/claim.h"

namespace sextant {

// ---- What the paper says of its fig. 4. Its bodies are the camera and the three nearest objects of a
// sequence; objects are told by their mean true distance. Intervals: bootstrap over seeds.
//
//   depth_noise_low         the largest mean error over the levels, once for delta_d <= 0.2 px (an industrial
//                           stereo camera, in the paper's words) and once for all levels of the sweep
//   depth_noise_gradual     slope of E_t > 0
//   flow_noise_far_objects  the smaller slope of objects 2 and 3 minus the larger one of camera and object
//   1 > 0 flow_noise_highest      the larger mean error of objects 2 and 3 at the highest level. "Nearly"
//   is read as
//                           within 25 % of the stated value

/// One body of a noise sweep under one estimator.
struct CurveOfBody {
  std::string title;  ///< "camera", "object 1 (id 3)"
  std::span<const NoiseLevelRef> levels;
};
/// The camera, then the three nearest objects, as the paper counts them.
std::vector<CurveOfBody> nearest_bodies(const std::vector<std::span<const NoiseLevelRef>>& curves);

std::vector<ClaimResult> check_depth_noise_low(const NoiseSweep& sweep);
std::vector<ClaimResult> check_depth_noise_gradual(const NoiseSweep& sweep);
std::vector<ClaimResult> check_flow_noise_far_objects(const NoiseSweep& sweep);
std::vector<ClaimResult> check_flow_noise_highest(const NoiseSweep& sweep);

// ---- What noise that is independent from pixel to pixel hides. Sweeps of one data set with the same
// levels and seeds, once with independent and once with spatially correlated noise of the same size
// (docs/noise.md):
//
//   independent_noise_is_kind  k = mean error with correlated / mean error with independent noise, over the
//   cases that
//                              both have (level, seed, frame), for camera and the three nearest objects; > 1.
//                              Interval: bootstrap over seeds

std::vector<ClaimResult> check_independent_noise_is_kind(const Evidence& evidence);

// ---- Claims on the paper's three sets, per set and kind of data. Intervals: bootstrap over seeds, which
// draw the same noise for both estimators.
//
//   joint_camera      100 (E_t of motion only / E_t of joint - 1) %, means over the pairs that both
//                     estimated. "About 300 %" is read as at least 100 %: a third of it
//   joint_objects     the same of objects; stated 10 .. 20 %
//   gain_is_selection (a) that gain with both functions on equal points, RANSAC inliers at 0.3 px or all,
//   with
//                     the kernel of the published code's joint function: 0, read as within 1 %; (b) what one
//                     function loses on the inliers against all points: the camera's 300 %
//   joint_is_matched  the largest difference of E_t of a pair, below 1e-6 m: with the default options the
//                     effective kernel of joint (estimator/solvers/robust_kernel.h) is that of motion only
//   epe_falls         change of the mean EPE of joint by refinement, in %, below 0
//   classification    share of wrong decisions, at most the paper's of that sequence

std::vector<ClaimResult> check_joint_camera(const Evidence& evidence);
std::vector<ClaimResult> check_joint_objects(const Evidence& evidence);
std::vector<ClaimResult> check_gain_is_selection(const Evidence& evidence);
std::vector<ClaimResult> check_joint_is_matched(const Evidence& evidence);
std::vector<ClaimResult> check_epe_falls(const Evidence& evidence);
std::vector<ClaimResult> check_classification(const Evidence& evidence);

// ---- Claims on real data. Intervals: bootstrap over stretches of 5 frames, which depend on each other.
//
//   velocity            mean E_v of joint per object that the paper names; stated 2 .. 5 km/h
//   ahead_of_orb_slam   mean E_t of joint less that of ORB-SLAM3's recorded trajectory, same frames; < 0
//   within_floor        the size of that difference, and of the published one, against the RMS floor of the
//                       truth
//   rotation_floor      the published mean E_R, and that of ORB-SLAM3's recorded trajectories, against the
//   rotation
//                       floor of the truth of the recorded sequences, RMS: from timing alone to turn rates
//   frame_rate          1000 / mean of the frame's ms (table VII); stated at least 6

std::vector<ClaimResult> check_velocity(const Evidence& evidence);
std::vector<ClaimResult> check_ahead_of_orb_slam(const Evidence& evidence);
std::vector<ClaimResult> check_within_floor(const Evidence& evidence);
std::vector<ClaimResult> check_rotation_floor(const Evidence& evidence);
std::vector<ClaimResult> check_frame_rate(const Evidence& evidence);

}  // namespace sextant
