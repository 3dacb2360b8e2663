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
Eigen::Matrix3d opencv_from_axes(Axes axes);

}  // namespace sextant
