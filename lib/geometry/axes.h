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
#include <string>
#include <string_view>
#include <vector>

namespace sextant {

const std::vector<std::string>& axes_names();

/// R with p_opencv = R p_named: a permutation of axes and signs, exact. Throws Error on an unknown name.
Eigen::Matrix3d opencv_from_axes(std::string_view name);

}  // namespace sextant
