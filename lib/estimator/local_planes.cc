#include "sextant/estimator/local_planes.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace sextant {
namespace {

constexpr int min_neighbours = 9;  // three unknowns, six to judge them
constexpr double max_pixel = 1e5;  // beyond, numbers are not those of an image

constexpr double max_columns = 1000;

/// Points by cell of at least `side` px, cells row by row.
class CellGrid {
 public:
  CellGrid(const Correspondences& points, const std::vector<unsigned char>& valid, double side)
      : side_(side) {
    double max_u = -INFINITY, max_v = -INFINITY;
    min_u_ = min_v_ = INFINITY;
    for (size_t i = 0; i < points.size(); ++i) {
      if (valid[i] == 0) continue;
      min_u_ = std::min(min_u_, points.u[i]);
      min_v_ = std::min(min_v_, points.v[i]);
      max_u = std::max(max_u, points.u[i]);
      max_v = std::max(max_v, points.v[i]);
    }
    if (!(max_u >= min_u_)) max_u = min_u_ = max_v = min_v_ = 0;  // no point
    // Few points far apart need no grid as fine as that.
    side_ = std::max({side_, (max_u - min_u_) / max_columns, (max_v - min_v_) / max_columns});
    columns_ = static_cast<int>((max_u - min_u_) / side_) + 1;
    rows_ = static_cast<int>((max_v - min_v_) / side_) + 1;
    begin_.assign(static_cast<size_t>(columns_) * rows_ + 1, 0);
    for (size_t i = 0; i < points.size(); ++i) {
      if (valid[i] != 0) ++begin_[cell(points.u[i], points.v[i]) + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    members_.resize(begin_.back());
    std::vector<size_t> next(begin_.begin(), begin_.end() - 1);
    for (size_t i = 0; i < points.size(); ++i) {
      if (valid[i] != 0) members_[next[cell(points.u[i], points.v[i])]++] = i;
    }
  }

  template <typename F>
  void for_each_near(double u, double v, F&& f) const {
    const int column = static_cast<int>((u - min_u_) / side_);
    const int row = static_cast<int>((v - min_v_) / side_);
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, rows_ - 1); ++y) {
      const size_t first = static_cast<size_t>(y) * columns_ + std::max(column - 1, 0);
      const size_t last = static_cast<size_t>(y) * columns_ + std::min(column + 1, columns_ - 1);
      for (size_t k = begin_[first]; k < begin_[last + 1]; ++k) f(members_[k]);
    }
  }

 private:
  size_t cell(double u, double v) const {
    return static_cast<size_t>((v - min_v_) / side_) * columns_ + static_cast<size_t>((u - min_u_) / side_);
  }
  double side_, min_u_ = 0, min_v_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<size_t> begin_, members_;
};

}  // namespace

std::vector<LocalPlane> fit_local_planes(const Correspondences& points, double kappa, double radius_px) {
  std::vector<LocalPlane> planes(points.size());
  std::vector<unsigned char> valid(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    valid[i] = points.depth[i] > 0 && std::isfinite(points.depth[i]) && std::abs(points.u[i]) < max_pixel &&
               std::abs(points.v[i]) < max_pixel;
  }
  std::vector<double> inverse(points.size());
  for (size_t i = 0; i < points.size(); ++i) inverse[i] = 1 / points.depth[i];
  if (points.size() < min_neighbours || !(kappa > 0)) return planes;
  const CellGrid grid(points, valid, radius_px);
  for (size_t i = 0; i < points.size(); ++i) {
    if (valid[i] == 0) continue;
    // Moments about the point itself.
    double n = 0, su = 0, sv = 0, suu = 0, suv = 0, svv = 0, s = 0, us = 0, vs = 0, ss = 0;
    grid.for_each_near(points.u[i], points.v[i], [&](size_t j) {
      const double u = points.u[j] - points.u[i];
      const double v = points.v[j] - points.v[i];
      if (std::abs(u) > radius_px || std::abs(v) > radius_px) return;
      const double value = inverse[j] - inverse[i];
      n += 1, su += u, sv += v, suu += u * u, suv += u * v, svv += v * v;
      s += value, us += u * value, vs += v * value, ss += value * value;
    });
    if (n < min_neighbours) continue;
    Eigen::Matrix3d normal;
    normal << n, su, sv, su, suu, suv, sv, suv, svv;
    if (!(normal.determinant() > 1e-3 * n * suu * svv)) continue;
    const Eigen::Vector3d right(s, us, vs);
    const Eigen::Vector3d plane = normal.inverse() * right;
    const double dof = n - 3;
    const double residual = (ss - right.dot(plane)) / (kappa * kappa);
    if (residual > dof + 2.33 * std::sqrt(2 * dof)) continue;
    planes[i] = {true, plane[1], plane[2]};
  }
  return planes;
}

}  // namespace sextant
