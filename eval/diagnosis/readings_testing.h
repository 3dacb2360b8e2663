#pragma once

// A drive past cars, from whose motions and poses the tests of the readings make wrong logs.

#include <cmath>
#include <map>

#include "sextant/eval/diagnosis/motion_readings.h"
#include "sextant/geometry/se3.h"

namespace sextant {

/// Cars with speeds from `slow_m` a frame on, seen from a camera that drives and turns.
struct Scene {
  std::map<ObjectFrame, SE3> L;  // T_world_object
  std::map<int, SE3> C;          // T_world_camera
};

inline SE3 about_y(double angle, const Eigen::Vector3d& t) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())), t};
}

inline Scene scene(int n_objects, int n_frames, double slow_m) {
  Scene out;
  SE3 camera = about_y(0.3, {4, 0, 2});
  for (int k = 0; k < n_frames; ++k) {
    out.C[k] = camera;
    camera = camera * about_y(0.01 * std::sin(0.3 * k), {0, 0.002 * k, 0.9 + 0.1 * std::sin(0.4 * k)});
  }
  for (int id = 1; id <= n_objects; ++id) {
    SE3 pose = about_y(1.2 * id, {-3.0 + 4 * id, 1, 8.0 + 9 * id});
    for (int k = 0; k < n_frames; ++k) {
      out.L[{id, k}] = pose;
      const double speed = slow_m * (1 + 0.5 * id) * (1 + 0.4 * std::sin(0.7 * k + id));
      pose = pose * about_y(0.02 * std::cos(0.5 * k), {0, 0, speed});
    }
  }
  return out;
}

/// Returns `T` in axes of which z points the opposite way.
inline SE3 mirrored_z(const SE3& T) {
  const Eigen::DiagonalMatrix<double, 3> mirror(1, 1, -1);
  const Eigen::Matrix3d R = mirror * T.rotation().toRotationMatrix() * mirror;
  return SE3(Eigen::Quaterniond(R), mirror * T.translation());
}

}  // namespace sextant
