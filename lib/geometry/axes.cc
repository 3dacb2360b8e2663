#include "sextant/geometry/axes.h"

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {

const std::vector<std::string>& axes_names() {
  static const std::vector<std::string> names = {"opencv", "opengl", "ned", "flu"};
  return names;
}

Eigen::Matrix3d opencv_from_axes(std::string_view name) {
  // Columns: where x, y and z of the named axes point, as right, down, forward.
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (name == "opencv") return R;
  if (name == "opengl") {
    R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  } else if (name == "ned") {
    R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  } else if (name == "flu") {
    R << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  } else {
    fail("unknown axes '{}': {}", name, suggest(name, axes_names()));
  }
  return R;
}

}  // namespace sextant
