#pragma once

// AP3P (Ke & Roumeliotis, CVPR 2017; the paper's ref. for its robust start): the motions that bring three
// points onto three rays,
//
//   d_i ray_i = R point_i + t,   d_i > 0 for the right one; the others are left to the caller's vote.
//
// One angle's cosine is the root of a quartic, the rest follows without further trigonometry. Rays of unit
// length. Degenerate triangles give no solution.

#include <array>

#include "sextant/geometry/se3.h"

namespace sextant {

class P3PSolutions {
 public:
  P3PSolutions(const std::array<Eigen::Vector3d, 3>& points, const std::array<Eigen::Vector3d, 3>& rays);
  const SE3* begin() const { return motions_.data(); }
  const SE3* end() const { return motions_.data() + size_; }
  size_t size() const { return size_; }

 private:
  std::array<SE3, 4> motions_;
  size_t size_ = 0;
};

/// Real parts of the roots of x^4 + a[0] x^3 + a[1] x^2 + a[2] x + a[3] (Ferrari),
/// polished by Newton's method.
std::array<double, 4> quartic_roots(const std::array<double, 4>& a);

}  // namespace sextant
