#pragma once

// Camera poses by frame number. A frame without a pose is absent; it never gets an identity pose.

#include <Eigen/Core>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "sextant/geometry/se3.h"

namespace sextant {

class Trajectory {
 public:
  void set(int frame, const SE3& T_world_camera) { poses_[frame] = T_world_camera; }
  bool has(int frame) const { return poses_.contains(frame); }
  std::optional<SE3> pose(int frame) const {
    return has(frame) ? std::optional(poses_.at(frame)) : std::nullopt;
  }

  /// Returns T_prev_curr, the camera's own motion; nullopt if either pose is missing.
  std::optional<SE3> motion(int prev, int curr) const {
    if (!has(prev) || !has(curr)) return std::nullopt;
    return poses_.at(prev).inverse() * poses_.at(curr);
  }

  const std::map<int, SE3>& poses() const { return poses_; }
  bool empty() const { return poses_.empty(); }

 private:
  std::map<int, SE3> poses_;
};

// A recorded sequence of poses T_world_body in order of time. Unlike Trajectory, it stores rotations as the
// matrices that were read: a file with 7 digits contains matrices that are off SO(3) by 1e-7, and projecting
// them would change the smallest errors. Each list has the length of `positions_m` or is empty.
//
// A recording of positions alone (GNSS, a prism) has no rotations; relative_pose() and pose() require them. A
// covariance describes the error (e_p, e_R) of a pose in the axes of the world, as in ROS's
// PoseWithCovariance:
//
//   e_p = p_true - p_world_body  [m]        e_R = log(R_true R_world_body')  [rad]
//
// Position comes first in rows and columns; readers convert files in another convention to this one.

using PoseCovariance = Eigen::Matrix<double, 6, 6>;

struct PoseSeries {
  std::vector<Eigen::Matrix3d> rotations;  ///< empty: positions only
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<double> stamps_s;             ///< empty: the recording has no time stamps
  std::vector<int> frames;                  ///< empty: the recording has no frame numbers
  std::vector<PoseCovariance> covariances;  ///< m^2, m rad, rad^2; empty: the recording has none
  std::vector<int> lines;  ///< line numbers of the text file, from 1; empty: not read from a text file

  size_t size() const { return positions_m.size(); }
  bool empty() const { return positions_m.empty(); }
  bool has_rotations() const { return !rotations.empty() || positions_m.empty(); }

  void reserve(size_t n);
  void add(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position_m);
  void add(const SE3& pose) { add(pose.rotation().toRotationMatrix(), pose.translation()); }
  /// Transforms covariance i for a change of pose i = (R_i, p_i) to position s R p_i + t + l and rotation R
  /// R_i, also if a constant rotation of the body axes follows. The lever arm l = `lever_world_m` is constant
  /// in the body frame, but given in the axes of the new world (m). Does nothing if the series has no
  /// covariances.
  void transform_covariance(size_t i, const Eigen::Matrix3d& R, double s,
                            const Eigen::Vector3d& lever_world_m = Eigen::Vector3d::Zero());
  /// Replaces the series by its poses with the given indices, in the order of `indices`; an index may be
  /// repeated.
  void keep(std::span<const int> indices);
  SE3 pose(size_t i) const;
};

/// Returns the length of the path from the first position to each one, m.
std::vector<double> path_lengths_m(const PoseSeries& series);

/// Relative pose inverse(T_i) T_j, with the rotation inverted by transposition.
struct RelativePose {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation_m;
};
RelativePose relative_pose(const PoseSeries& series, size_t i, size_t j);

// Interpolation of recorded poses. Between consecutive stamps t_i <= t <= t_j, with w = (t - t_i) / (t_j -
// t_i):
//
//   p = (1 - w) p_i + w p_j          R = R_i exp(w log(R_i' R_j))      (straight line; slerp along the
//                                    shorter arc)
//
// At a recorded stamp the result is the recorded pose, bit for bit. Nothing is extrapolated, and gaps longer
// than max_gap_s are not bridged.

struct InterpolatedPoses {
  PoseSeries poses;             ///< positions, stamps and, if recorded, rotations
  std::vector<int> rows;        ///< by pose: index of the nearest recorded pose; the earlier one of a tie
  std::vector<int> asked;       ///< by pose: index into the requested times
  double largest_gap_s = 0;     ///< longest gap that was bridged
  size_t n_outside = 0;         ///< requested times before the first or after the last pose
  size_t n_in_longer_gaps = 0;  ///< requested times inside gaps above max_gap_s
};

/// Interpolates `series` at the ascending times `times_s`. Its stamps must be strictly ascending; throws
/// InternalError if it has none.
InterpolatedPoses interpolate_poses(const PoseSeries& series, std::span<const double> times_s,
                                    double max_gap_s);

}  // namespace sextant
