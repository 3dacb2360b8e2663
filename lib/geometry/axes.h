#pragma once

// Named conventions for the coordinate axes of a world frame or of a body frame.
//
//   name     x        y      z         used by
//   opencv   right    down   forward   cameras here, KITTI's images, ORB-SLAM
//   opengl   right    up     backward  renderers, ARKit, NeRF
//   ned      forward  right  down      aircraft and drones (north, east, down), AirSim, TartanAir
//   flu      forward  left   up        ROS (REP 103), KITTI's GPS/IMU
//
// All are right-handed.

#include <Eigen/Core>

#include "sextant/base/names.h"

namespace sextant {

enum class Axes { opencv, opengl, ned, flu };
constexpr Names<4> names_of(Axes) { return {"opencv", "opengl", "ned", "flu"}; }

/// Returns the exact permutation R (with signs) for which p_opencv = R p_named.
inline Eigen::Matrix3d opencv_from_axes(Axes axes) {
  // Columns: the directions of x, y and z of the named axes, in coordinates right, down, forward.
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (axes == Axes::opengl) R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  if (axes == Axes::ned) R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  if (axes == Axes::flu) R << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return R;
}

}  // namespace sextant
