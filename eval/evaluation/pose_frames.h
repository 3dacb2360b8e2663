#pragma once

// Frame conventions of a recorded pose, and the conversion to the pose of a camera in opencv axes:
//
//   T_world_camera = C * T_world_body * T_body_camera
//
//   T_world_body    the pose in the file, inverted if `inverse`; world and body have the axes `axes`
//                   (lib/geometry/axes.h)
//   C               rotation from these axes to opencv's, applied to the world: C p_world
//   T_body_camera   pose of the camera in the body: p_body = T_body_camera p_camera. Its translation is the
//                   lever arm in m, along the axes of the body in the file. Its rotation is C^-1 by default,
//                   for a camera that looks forward. A given rotation is used unchanged: it maps the camera's
//                   axes to the body axes of the file, as calibrations do (the inverse of Kalibr's
//                   T_cam_imu).
//
// With the defaults the poses stay unchanged, bit for bit.

#include <Eigen/Core>
#include <optional>
#include <string>

#include "sextant/geometry/axes.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Pose of the camera in the body; without a rotation, see T_body_camera above.
struct BodyFromCamera {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::optional<Eigen::Matrix3d> rotation;
};

/// Conventions of the poses in one file.
struct PoseFrame {
  Axes axes = Axes::opencv;
  std::optional<BodyFromCamera> body_from_camera;
  bool inverse = false;  ///< the file contains T_body_world

  bool is_default() const { return axes == Axes::opencv && !body_from_camera && !inverse; }
  /// Returns T_body_camera with the default rotation filled in.
  Eigen::Matrix4d matrix() const;
};

/// Parses 3 numbers (position), 12 or 16 numbers (matrix row by row) separated by blanks or commas, or the
/// name of a file that contains such numbers. Throws Error on anything else, if the 3x3 part of the matrix is
/// no rotation, and if the camera is more than 1000 m from the body.
BodyFromCamera parse_body_from_camera(const std::string& text);
/// Parses the content of such a file; `name` begins error messages.
BodyFromCamera decode_body_from_camera(const std::string& content, const std::string& name);

/// Converts poses to T_world_camera in opencv axes. Throws Error if `frame` has an inverse or a
/// T_body_camera, and the poses are positions without rotations.
void to_camera(PoseSeries& poses, const PoseFrame& frame);

/// Parses x, y, z, -x, -y, -z or three numbers into a unit vector. Throws Error on anything else.
Eigen::Vector3d parse_direction(const std::string& text);

}  // namespace sextant
