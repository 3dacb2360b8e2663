#pragma once

// Readings of the numbers of one motion or pose P, whatever its frame is: in another unit, with rotations in
// another order or transposed, and in other axes.
//
//   centimetres, millimetres, too_small_100, too_small_1000
//   quaternion_w_first, quaternion_w_last, transposed
//   axes_opengl, axes_ned, axes_flu      C P inverse(C), C the rotation from these axes to opencv's
//                                        (geometry/axes.h)
//   mirrored_x, mirrored_y, mirrored_z   M P M, M the reflection of one axis: left-handed axes

#include <functional>
#include <string>
#include <vector>

#include "sextant/geometry/se3.h"

namespace sextant {

struct NumberReading {
  std::string code, cause, remedy;
  std::function<SE3(const SE3&)> read;
  double price = 0;  ///< hypothesis.h
};

/// Returns all readings. `translations` names the translations in the texts: "positions".
std::vector<NumberReading> number_readings(const std::string& translations, double price_of_axes);

/// Returns the readings of rotations: quaternion_w_first, quaternion_w_last and transposed.
std::vector<NumberReading> rotation_readings(const std::string& translations);

/// Returns the remedy of mirrored_x (axis 0), mirrored_y or mirrored_z: "negate x, qy and qz in each line".
std::string mirror_remedy(int axis);

}  // namespace sextant
