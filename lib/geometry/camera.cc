#include "sextant/geometry/camera.h"

#include <cmath>

#include "sextant/base/error.h"

namespace sextant {
namespace {

// With focal lengths outside this range, a ray or its square may not be a finite double.
constexpr double smallest_focal = 1e-6, largest_focal = 1e9;

}  // namespace

void PinholeCamera::check() const {
  const auto is_focal = [](double f) { return f >= smallest_focal && f <= largest_focal; };
  const auto is_centre = [](double c) { return std::abs(c) <= largest_focal; };
  if (!is_focal(fx) || !is_focal(fy) || !is_centre(cx) || !is_centre(cy)) {
    fail("camera fx={} fy={} cx={} cy={}: expected fx and fy from {} to {}, cx and cy from {} to {} (px)", fx,
         fy, cx, cy, smallest_focal, largest_focal, -largest_focal, largest_focal);
  }
}

void StereoCamera::check() const {
  left.check();
  if (!(bf >= smallest_focal && bf <= largest_focal)) {
    fail("camera bf={}: expected a number from {} to {} (px m)", bf, smallest_focal, largest_focal);
  }
}

}  // namespace sextant
