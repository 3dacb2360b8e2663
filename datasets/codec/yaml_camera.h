#pragma once

// Stereo cameras in OpenCV YAML, as ORB-SLAM2 and VDO-SLAM have them: "%YAML:1.0" and the keys Camera.fx,
// Camera.fy, Camera.cx, Camera.cy (px), Camera.bf (focal length times baseline, px m); optionally
// Camera.fps (Hz).

#include <string>
#include <string_view>

#include "sextant/geometry/camera.h"

namespace sextant {

struct YamlCamera {
  StereoCamera camera;
  double rate_hz = 0;  ///< 0 = not given
};

/// Throws Error that names the missing keys, or the key whose value is not a positive number.
YamlCamera decode_yaml_camera(std::string_view text, const std::string& name);

std::string encode_yaml_camera(const YamlCamera& camera);

}  // namespace sextant
