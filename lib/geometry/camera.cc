#include "sextant/geometry/camera.h"

#include <cmath>

#include "sextant/base/error.h"

namespace sextant {

void PinholeCamera::check() const {
  const bool finite = std::isfinite(fx) && std::isfinite(fy) && std::isfinite(cx) && std::isfinite(cy);
  if (!finite || fx <= 0 || fy <= 0) {
    fail("camera fx={} fy={} cx={} cy={}: expected finite numbers with fx > 0 and fy > 0", fx, fy, cx, cy);
  }
}

void StereoCamera::check() const {
  left.check();
  if (!std::isfinite(bf) || bf <= 0) fail("camera bf={}: expected a finite number > 0 (px m)", bf);
}

}  // namespace sextant
