#pragma once

// Hypotheses about a pair of trajectories from third-party files, for the rule of hypothesis.h.
//
//   code        the poses are                                       found from
//   inverse     T_camera_world                                      the pair, or each alone
//   axes        in the axes opengl, ned or flu, world and body      the pair
//   columns     quaternions with w at the other end                 the pair, or each alone
//   transposed  with transposed rotations, positions as they are    the pair, or each alone
//   mirrored    with one axis of the opposite sign: of both        the pair
//               world and body, or of the positions alone
//   unit        in cm or mm, on either side, or the estimate in km  the pair, unless the alignment scales
//   degrees     latitude and longitude in degrees as x and y        the pair
//   angles      with rotations by twice or half of the angle        the pair
//   steps       T_k-1,k or T_k,k-1 instead of T_0,k                 the pair
//   body        of a body with other axes: turned from the right    the pair
//   world       in a world with other axes: turned from the left    the pair, unless the alignment rotates
//
// "Each alone" is based on the fact that a vehicle moves along one direction of its own axes. Let u_i be the
// direction of a piece of the path in the axes of the body at the middle of the piece. The scatter is the RMS
// angle between the u_i and their principal axis, whatever the sign of u_i. It is small for a vehicle with
// correct poses, and large in turns if the poses are inverse. Hand-held cameras and cameras that fly sideways
// have a large scatter in every reading; nothing is concluded from these.

#include <Eigen/Core>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/hypothesis.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Associated poses: element i of the reference and of the estimate belong together.
struct TrajectoryPair {
  PoseSeries reference, estimate;

  size_t size() const { return estimate.size(); }
  bool has_rotations() const { return reference.has_rotations() && estimate.has_rotations(); }
};

/// Overload for a rotation matrix.
inline double rotation_angle_rad(const Eigen::Matrix3d& R) {
  return rotation_angle_rad(Eigen::Quaterniond(R));
}

Eigen::Vector3d mean_position(const PoseSeries& series);
/// RMS distance of the positions from their mean, m.
double rms_extent_m(const PoseSeries& series);

struct TrajectoryHypothesisOptions {
  bool converted_estimate = false;   ///< axes or a body were given for the estimate: they are not questioned
  bool converted_reference = false;  ///< axes or a body were given for the reference: they are not questioned
  bool turns_world = false;          ///< the alignment rotates the world, so "world" changes nothing
  bool scales = false;               ///< the alignment scales, so "unit" changes nothing
};

/// Returns the hypotheses of the table that apply to a pair that is not yet aligned.
std::vector<Hypothesis<TrajectoryPair>> trajectory_hypotheses(const TrajectoryHypothesisOptions& options);

/// Returns the path that a file of steps E_k = T_k-1,k describes, P_k = P_k-1 E_k, from the identity on. If
/// `inverse`, the steps are T_k,k-1 and are inverted first.
PoseSeries chained(const PoseSeries& steps, bool inverse);
/// Replaces T_world_camera by T_camera_world or back, with the covariances.
void invert(PoseSeries& poses);

/// Returns the reading "inverse", "columns" or "transposed" that explains the poses alone; nullopt if none
/// does. The declared reading must have a scatter of at least 20 deg. The returned one has at most 10 deg, a
/// square that is at least five times smaller, and a path that is at most 1 % longer.
std::optional<Explanation> explain_alone(const PoseSeries& poses);

/// Returns true if the rotation is within `angle_rad` of one of the 24 rotations that map axes to axes, the
/// identity included.
bool is_near_axes(const Eigen::Matrix3d& R, double angle_rad);
/// Returns the length of the path in m, as the sum of the chords of pieces of about a hundredth of the path,
/// to which noise adds little.
double path_in_pieces_m(const PoseSeries& poses);

/// Formats a pose as the argument of --body-from-camera: 12 numbers in quotes.
std::string body_from_camera_numbers(const Eigen::Matrix3d& R,
                                     const Eigen::Vector3d& t = Eigen::Vector3d::Zero());

}  // namespace sextant
