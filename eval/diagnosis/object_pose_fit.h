#pragma once

// Poses T_world_object of the objects of a log that contains motions only, estimated from two descriptions of
// the same motions. For each stretch of eight or more successive steps of one object, the first pose L_0
// minimises in least squares the error of
//
//   H_k L_{k-1} = L_{k-1} B_k
//
// with H_k the motion in the world and B_k that in the body frame (motion_readings.h). The reference motions
// then give the other poses of the stretch. Samples of shorter stretches get no pose.

#include <functional>
#include <optional>

#include "sextant/eval/diagnosis/motion_readings.h"

namespace sextant {

/// Function that returns the motion of a sample in the world frame; empty if a pose that this needs is not
/// known.
using WorldMotion = std::function<std::optional<SE3>(const MotionSample&)>;

/// Fits the poses with B_k the reference and H_k = in_world(), so that L_k = L_{k-1} B_k.
void fit_poses_to_body_reference(MotionData& data, const WorldMotion& in_world);
/// Fits the poses with H_k the reference and B_k the given motion, so that L_k = H_k L_{k-1}.
void fit_poses_to_world_reference(MotionData& data);

}  // namespace sextant
