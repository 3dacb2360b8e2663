#pragma once

// Camera poses by frame number. A frame without a pose has none: never an identity in its place.

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

  /// T_prev_curr: the camera's own motion; empty when either pose is missing.
  std::optional<SE3> motion(int prev, int curr) const {
    if (!has(prev) || !has(curr)) return std::nullopt;
    return poses_.at(prev).inverse() * poses_.at(curr);
  }

  const std::map<int, SE3>& poses() const { return poses_; }
  bool empty() const { return poses_.empty(); }

 private:
  std::map<int, SE3> poses_;
};

// A recorded path of poses T_world_body, in the order of time. Unlike Trajectory, its rotations are the
// matrices as read: a file that rounds them to 7 digits holds matrices that are off SO(3) by 1e-7, and
// projecting them would change the smallest errors. All lists are as long as `positions_m` or empty.
//
// A recording of positions alone (GNSS, a prism) has no rotations; relative_pose() and pose() need them.
// A covariance is of the error (e_p, e_R) of a pose, both in the axes of the world, as ROS has it in
// PoseWithCovariance:
//
//   e_p = p_true - p_world_body  [m]        e_R = log(R_true R_world_body')  [rad]
//
// position first, row and column alike; readers of files in another convention convert.

using PoseCovariance = Eigen::Matrix<double, 6, 6>;

struct PoseSeries {
  std::vector<Eigen::Matrix3d> rotations;  ///< empty: positions alone
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<double> stamps_s;  ///< empty: the recording has no time stamps
  std::vector<int> frames;       ///< empty: the recording has no frame numbers
  std::vector<PoseCovariance> covariances;  ///< m^2, m rad, rad^2; empty: the recording has none
  std::vector<int> lines;                   ///< of the text file, 1 for the first; empty: not of a text file

  size_t size() const { return positions_m.size(); }
  bool empty() const { return positions_m.empty(); }
  bool has_rotations() const { return !rotations.empty() || positions_m.empty(); }

  void reserve(size_t n);
  void add(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position_m);
  /// Covariance i moves along where pose i becomes [s R | t] (pose) [I | l], with l = `lever_world_m` in the
  /// axes of the new world.
  void transform_covariance(size_t i, const Eigen::Matrix3d& R, double s,
                            const Eigen::Vector3d& lever_world_m = Eigen::Vector3d::Zero());
  /// The poses with the given indices, in that order; an index may come twice.
  void keep(std::span<const int> indices);
  SE3 pose(size_t i) const;
};

/// inverse(T_i) T_j: the rotation part inverts by transposition.
struct RelativePose {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation_m;
};
RelativePose relative_pose(const PoseSeries& series, size_t i, size_t j);

// Poses between recorded ones. Between stamps t_i <= t <= t_j that follow each other,
// w = (t - t_i) / (t_j - t_i):
//
//   p = (1 - w) p_i + w p_j          R = R_i exp(w log(R_i' R_j))      (straight line; slerp, the shorter
//                                    way)
//
// At a recorded stamp it is the recorded pose, bit for bit. Nothing is extrapolated, and no gap longer than
// max_gap_s is bridged.

struct InterpolatedPoses {
  PoseSeries poses;             ///< stamps as asked for; no frame numbers
  std::vector<int> rows;        ///< of the recorded pose nearest in time, the earlier of two as near
  std::vector<int> asked;       ///< index into the times asked for
  double largest_gap_s = 0;     ///< that was bridged
  size_t n_outside = 0;         ///< times before the first or after the last pose
  size_t n_in_longer_gaps = 0;  ///< times within gaps above max_gap_s
};

/// `series` has stamps, strictly ascending; times ascending.
InterpolatedPoses interpolate_poses(const PoseSeries& series, std::span<const double> times_s,
                                    double max_gap_s);

}  // namespace sextant
