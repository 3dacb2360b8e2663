#pragma once

// Names for the directions of coordinate axes, of a world and of a body alike.
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

/// R with p_opencv = R p_named: a permutation of axes and signs, exact.
inline Eigen::Matrix3d opencv_from_axes(Axes axes) {
  // Columns: where x, y and z of the named axes point, as right, down, forward.
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (axes == Axes::opengl) R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  if (axes == Axes::ned) R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  if (axes == Axes::flu) R << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return R;
}

}  // namespace sextant
