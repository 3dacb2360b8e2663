#pragma once

// What a recorded pose is a pose of, and in which axes; from there to the pose of a camera in opencv axes:
//
//   T_world_camera = C * T_world_body * T_body_camera
//
//   T_world_body    the pose in the file, or with `inverse` its inverse, world and body in the axes named (lib/geometry/axes.h)
//   C               those axes to opencv, applied to the world (C p_world)
//   T_body_camera   pose of the camera in the body: p_body = T_body_camera p_camera. Its translation is the
//                   lever arm, in m along the body's own axes. Its rotation, where none is given, is C^-1: a
//                   camera that looks forward, in opencv axes. One that is given is used as it is, and then
//                   maps from the camera's axes to the file's body axes, as calibrations (Kalibr's inverse of
//                   T_cam_imu) have it.
//
// With nothing given the poses are untouched, bit for bit.

#include <Eigen/Core>
#include <optional>
#include <string>

#include "sextant/geometry/axes.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

struct BodyFromCamera {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::optional<Eigen::Matrix3d> rotation;
};

struct PoseFrame {
  Axes axes = Axes::opencv;
  std::optional<BodyFromCamera> body_from_camera;
  bool inverse = false;  ///< the file holds T_body_world

  bool is_default() const { return axes == Axes::opencv && !body_from_camera && !inverse; }
  /// T_body_camera as it is applied.
  Eigen::Matrix4d matrix() const;
};

/// 3 (position alone), 12 or 16 numbers (matrix row by row) with blanks or commas between them, or the name
/// of a file of them. Throws Error on anything else, on what is no rotation, and on a position beyond 1000 m.
BodyFromCamera parse_body_from_camera(const std::string& text);
/// The same from the content of a file; `name` begins messages.
BodyFromCamera decode_body_from_camera(const std::string& content, const std::string& name);

void to_camera(PoseSeries& poses, const PoseFrame& frame);

/// x, y, z, -x, -y, -z, or three numbers: a unit vector. Throws Error.
Eigen::Vector3d parse_direction(const std::string& text);

}  // namespace sextant
