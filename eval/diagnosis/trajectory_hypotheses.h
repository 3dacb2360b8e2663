#pragma once

// Readings of a pair of trajectories that others wrote, for the rule of hypothesis.h.
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

/// Poses that belong together, as many on both sides, not yet aligned.
struct TrajectoryPair {
  PoseSeries reference, estimate;
};

struct TrajectoryHypothesisOptions {
  bool converted_estimate = false;   ///< axes or a body were given for the estimate: they are not questioned
  bool converted_reference = false;  ///< the same of the reference
  bool turns_world = false;          ///< the alignment turns the world: "world" changes nothing
  bool scales = false;               ///< the alignment scales: "unit" changes nothing
};

/// Those of the table that apply to a pair.
std::vector<Hypothesis<TrajectoryPair>> trajectory_hypotheses(const TrajectoryHypothesisOptions& options);

/// P_k = P_k-1 E_k for poses E_k = T_k-1,k, or their inverses: what a file of steps holds of a path.
PoseSeries chained(const PoseSeries& steps, bool inverse);
/// T_camera_world for T_world_camera and back; covariances go along.
void invert(PoseSeries& poses);

/// See "each alone"; empty without turns or with fewer than 20 pieces of path.
std::optional<double> direction_scatter_deg(const PoseSeries& poses);

/// "inverse", "columns" or "transposed" where that reading of the poses alone has a scatter below 10 deg, at
/// least five times smaller in its square than that of the declared reading, which is above 20 deg, and the
/// path does not become longer.
std::optional<Explanation> explain_alone(const PoseSeries& poses);

/// Whether the rotation is within an angle of one that maps axes to axes, the identity among them.
bool is_near_axes(const Eigen::Matrix3d& R, double angle_rad);
/// Length of the path in pieces of a hundredth, which noise hardly adds to.
double path_in_pieces_m(const PoseSeries& poses);

/// A rotation as the 12 numbers of --body-from-camera.
std::string body_from_camera_numbers(const Eigen::Matrix3d& R);

}  // namespace sextant
