#include "sextant/geometry/axes.h"

namespace sextant {

Eigen::Matrix3d opencv_from_axes(Axes axes) {
  // Columns: where x, y and z of the named axes point, as right, down, forward.
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (axes == Axes::opengl) R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  if (axes == Axes::ned) R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  if (axes == Axes::flu) R << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return R;
}

}  // namespace sextant
