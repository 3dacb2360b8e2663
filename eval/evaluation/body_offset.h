#pragma once

// The constant pose of a camera in the body that an estimate is of, from the matched paths of the camera
// (reference) and of the body (estimate). Relative motions determine it, whatever the alignment of the
// worlds:
//
//   T_reference,ij = inverse(X) T_estimate,ij X,   X = T_body_camera,   j = i + k
//
// Source: the hand-eye equation A X = X B; Tsai, Lenz, A new technique for fully autonomous and efficient 3D
// robotics hand/eye calibration, IEEE Transactions on Robotics and Automation 5 (3), 1989.

#include <Eigen/Core>
#include <optional>

#include "sextant/eval/evaluation/trajectory_agreement.h"

namespace sextant {

/// Estimates the lever arm l with T_world_camera = T_world_body [I | l], from the matched paths of the camera
/// (reference) and of the body (estimate). It solves in least squares, with one scale s of the estimate,
///
///   t_reference,ij = s t_estimate,ij + (R_estimate,ij - I) l          j = i + k
///
/// with the smallest power of two k for which the rotations are 0.2 rad RMS, at most a quarter of the path. A
/// component of l that the rotations hardly determine (with less than 3 % of the best one's information),
/// such as the one along the axis of a car's turns, is 0. Empty if the rotations are below 0.02 rad RMS, or
/// for fewer than 10 poses.
std::optional<Eigen::Vector3d> estimate_lever_arm(const TrajectoryPair& pair);

/// Moves the poses of the estimate to the point of the body at `lever_m` in its own axes.
TrajectoryPair at_lever_arm(TrajectoryPair pair, const Eigen::Vector3d& lever_m);

/// A rotation of the body against the camera, with the squared errors of the translations that it explains.
struct BodyRotation {
  Eigen::Matrix3d body_from_camera;
  double squares_without = 0;  ///< sum of |t_reference,ij - s t_estimate,ij|^2, m^2
  double squares_with = 0;     ///< sum of |t_reference,ij - s R' t_estimate,ij|^2, m^2
};

/// Estimates R = R_body_camera from the translations over pieces of a hundredth of the path,
///
///   t_reference,ij = s R' t_estimate,ij + (R_reference,ij - I) l
///
/// by Gauss-Newton from R = I. The scale s and the lever arm l, 0 +- 2 m, are estimated with it, since in
/// turns a lever arm resembles a rotation. A component of the rotation that the translations hardly determine
/// (with less than 3 % of the information of translations perpendicular to its axis), such as that about a
/// car's longitudinal axis, is 0. Empty for fewer than 10 poses, and if the squared errors of the relative
/// rotations become larger by more than a tenth.
std::optional<BodyRotation> estimate_body_rotation(const TrajectoryPair& pair);

}  // namespace sextant
