#pragma once

// Hypotheses about a pair of trajectories from third-party files, for the rule of hypothesis.h.
//
//   code        the poses are                                       found from
//   inverse     T_camera_world                                      the pair, or each alone
//   axes        in the axes opengl, ned or flu, world and body      the pair
//   columns     quaternions with w at the other end                 the pair, or each alone
//   transposed  with transposed rotations, positions as they are    the pair, or each alone
//   unit        in cm or mm, or the others are                      the pair
//   steps       T_k-1,k or T_k,k-1 instead of T_0,k                 the pair
//   body        of a body with other axes: turned from the right    the pair
//   world       in a world with other axes: turned from the left    the pair, without an alignment that turns
//
// "Each alone": a vehicle moves along one direction of its own axes. With u_i the direction of a piece of
// path in the body's axes at its middle, the scatter is the RMS angle between u_i and their principal axis,
// either way: small for a vehicle read right, large in its turns where the poses are inverse. Cameras held in
// a hand or flying sideways scatter in every reading, and nothing is concluded.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Associated poses, the same number on both sides, not yet aligned.
struct TrajectoryPair {
  PoseSeries reference, estimate;
};

struct TrajectoryHypothesisOptions {
  bool converted_estimate = false;   ///< axes or a body were given for the estimate: they are not questioned
  bool converted_reference = false;  ///< axes or a body were given for the reference: they are not questioned
  bool turns_world = false;          ///< the alignment turns the world: "world" changes nothing
  bool scales = false;               ///< the alignment scales: "unit" changes nothing
};

/// Returns the hypotheses of the table that apply to a pair.
std::vector<Hypothesis<TrajectoryPair>> trajectory_hypotheses(const TrajectoryHypothesisOptions& options);

/// Chains the steps E_k = T_k-1,k, or their inverses, to poses P_k = P_k-1 E_k: the path that a file of
/// steps describes.
PoseSeries chained(const PoseSeries& steps, bool inverse);
/// Replaces T_world_camera by T_camera_world or back, with the covariances.
void invert(PoseSeries& poses);

/// RMS angle of "each alone" above, deg; empty for a path without turns or with fewer than 20 pieces.
std::optional<double> direction_scatter_deg(const PoseSeries& poses);

/// "inverse", "columns" or "transposed" where that reading of the poses alone has a scatter below 10 deg, at
/// least five times smaller in its square than that of the declared reading, which is above 20 deg, and the
/// path does not become longer.
std::optional<Explanation> explain_alone(const PoseSeries& poses);

/// Returns true if the rotation is within `angle_rad` of one of the 24 rotations that map axes to axes, the
/// identity included.
bool is_near_axes(const Eigen::Matrix3d& R, double angle_rad);
/// Length of the path measured over pieces of a hundredth of it, to which noise adds little, m.
double path_in_pieces_m(const PoseSeries& poses);

/// Formats a rotation as the 12 numbers of --body-from-camera.
std::string body_from_camera_numbers(const Eigen::Matrix3d& R);

}  // namespace sextant
