#pragma once

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

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sextant/geometry/se3.h"

namespace sextant {

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
  /// Covariance i moves along where pose i becomes [s R | t] (pose) [I | l], with l = `lever_world_m` in the axes
  /// of the new world.
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

}  // namespace sextant
