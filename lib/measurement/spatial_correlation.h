#pragma once

// Correlation of the errors at two pixels of one frame and channel, by their distance r:
//
//   rho(r) = sum_k share_k exp(-r^2 / (2 length_k^2)),   rho(0) = 1
//
// What the shares leave is independent from pixel to pixel. A mixture of Gaussians with shares >= 0 is positive
// definite in the plane, whatever the pixels.

#include <cmath>
#include <vector>

namespace sextant {

struct SpatialCorrelation {
  struct Part {
    double length_px = 0;
    double share = 0;  ///< of the variance
    bool operator==(const Part&) const = default;
  };
  std::vector<Part> parts;  ///< none: all errors are independent

  double independent_share() const {
    double rest = 1;
    for (const Part& part : parts) rest -= part.share;
    return rest > 1e-12 ? rest : 0;  // less is rounding of the shares
  }
  double at(double distance_px) const {
    double rho = distance_px == 0 ? independent_share() : 0;
    for (const Part& part : parts) {
      const double r = distance_px / part.length_px;
      rho += part.share * std::exp(-0.5 * r * r);
    }
    return rho;
  }
  bool operator==(const SpatialCorrelation&) const = default;
};

}  // namespace sextant
