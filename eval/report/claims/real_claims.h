#pragma once

// Claims on real data. Intervals: bootstrap over stretches of 5 frames, which depend on each other.
//
//   velocity            mean E_v of joint_flow per object that the paper names; stated 2 .. 5 km/h
//   ahead_of_orb_slam   mean E_t of joint_flow less that of ORB-SLAM3's recorded trajectory, same frames; < 0
//   within_floor        the size of that difference, and of the published one, against the RMS floor of the
//                       truth
//   rotation_floor      the published mean E_R, and that of ORB-SLAM3's recorded trajectories, against the rotation
//                       floor of the truth of the recorded sequences, RMS: from timing alone to turn rates
//   frame_rate          1000 / mean of the frame's ms (table VII); stated at least 6

#include <vector>

#include "sextant/eval/report/claims/claim.h"

namespace sextant {

std::vector<ClaimResult> check_velocity(const Evidence& evidence);
std::vector<ClaimResult> check_ahead_of_orb_slam(const Evidence& evidence);
std::vector<ClaimResult> check_within_floor(const Evidence& evidence);
std::vector<ClaimResult> check_rotation_floor(const Evidence& evidence);
std::vector<ClaimResult> check_frame_rate(const Evidence& evidence);

}  // namespace sextant
