#pragma once

// Point measurements between two frames, as structure of arrays; all arrays have the same length
// (before_noise: or none).
//
//   pixel p = (u, v) in the previous image, depth there, flow phi = (flow_u, flow_v): the pixel in the
//   current image is p + phi. depth_curr is the depth measured at the pixel nearest to p + phi; NaN = none
//   (docs/conventions.md, "Camera and measurements").

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace sextant {

struct Correspondences {
  std::vector<double> u;           ///< px
  std::vector<double> v;           ///< px
  std::vector<double> depth;       ///< m, previous frame
  std::vector<double> flow_u;      ///< px
  std::vector<double> flow_v;      ///< px
  std::vector<double> depth_curr;  ///< m, current frame; NaN = none
  /// Place among the points that noise was added to; empty: none was.
  std::vector<size_t> before_noise;

  size_t size() const { return u.size(); }
  bool empty() const { return u.empty(); }
  /// Pixel and flow are finite, and so is their sum.
  bool has_pixels(size_t i) const { return std::isfinite(u[i] + v[i] + flow_u[i] + flow_v[i]); }
  /// And so are depth and inverse depth, > 0.
  bool is_measurement(size_t i) const {
    return has_pixels(i) && depth[i] >= std::numeric_limits<double>::min() && depth[i] < INFINITY;
  }
  void reserve(size_t n);
  void push_back(double u_px, double v_px, double depth_m, double flow_u_px, double flow_v_px,
                 double depth_curr_m = NAN);
  /// The points whose mask entry is non-zero.
  Correspondences subset(const std::vector<unsigned char>& keep) const;
};

}  // namespace sextant
