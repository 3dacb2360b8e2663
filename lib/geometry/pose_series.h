#pragma once

// A recorded path of poses T_world_body, in the order of time. Unlike Trajectory, its rotations are the
// matrices as read: a file that rounds them to 7 digits holds matrices that are off SO(3) by 1e-7, and
// projecting them would change the smallest errors. All lists are as long as `positions_m` or empty.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sextant/geometry/se3.h"

namespace sextant {

struct PoseSeries {
  std::vector<Eigen::Matrix3d> rotations;
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<double> stamps_s;  ///< empty: the recording has no time stamps
  std::vector<int> frames;       ///< empty: the recording has no frame numbers

  size_t size() const { return positions_m.size(); }
  bool empty() const { return positions_m.empty(); }

  void reserve(size_t n);
  void add(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position_m);
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
