#pragma once

// Claims on the paper's three sets, per set and kind of data. Intervals: bootstrap over seeds, which draw the
// same noise for both estimators.
//
//   joint_camera      100 (E_t of motion_only / E_t of joint_flow - 1) %, means over the pairs that both
//                     estimated. "About 300 %" is read as at least 100 %: a third of it
//   joint_objects     the same of objects; stated 10 .. 20 %
//   gain_is_selection (a) that gain with both functions on equal points, RANSAC inliers at 0.3 px or all, with
//                     the kernel of the published code's joint function: 0, read as within 1 %; (b) what one
//                     function loses on the inliers against all points: the camera's 300 %
//   joint_is_matched  the largest difference of E_t of a pair, below 1e-6 m: with the default options the
//                     effective kernel of joint_flow (estimator/solvers/huber.h) is that of motion_only
//   epe_falls         change of the mean EPE of joint_flow by refinement, in %, below 0
//   classification    share of wrong decisions, at most the paper's of that sequence

#include <vector>

#include "sextant/eval/report/claims/claim.h"

namespace sextant {

std::vector<ClaimResult> check_joint_camera(const Evidence& evidence);
std::vector<ClaimResult> check_joint_objects(const Evidence& evidence);
std::vector<ClaimResult> check_gain_is_selection(const Evidence& evidence);
std::vector<ClaimResult> check_joint_is_matched(const Evidence& evidence);
std::vector<ClaimResult> check_epe_falls(const Evidence& evidence);
std::vector<ClaimResult> check_classification(const Evidence& evidence);

}  // namespace sextant
