#include "sextant/estimator/solvers/local_planes.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "sextant/estimator/solvers/pixel_extent.h"
#include "sextant/geometry/lanes.h"

namespace sextant {
namespace {

constexpr size_t min_neighbours = 9;  // three unknowns, six to judge them
constexpr double max_pixel = 1e5;     // beyond, numbers are not those of an image
constexpr double max_columns = 1000;

struct Point {
  double one = 1;
  double u, v;     // px
  double inverse;  // 1/m
};
static_assert(sizeof(Point) == sizeof(Lanes));
using Rows = std::array<std::span<const Point>, 3>;

/// Sum of p p^T over [1 u v s] - [0 u v s] of one of them, row by row.
SEXTANT_SIMD void sum_moments(const Rows& rows, const Point& about, double* moments) {
  const Lanes centre = {0, about.u, about.v, about.inverse};
  Lanes m0 = {}, m1 = {}, m2 = {}, m3 = {};
  for (const std::span<const Point>& row : rows) {
    for (const Point& point : row) {
      const Lanes p = SEXTANT_LOAD(&point.one) - centre;
      m0 += p;
      m1 += p * p[1];
      m2 += p * p[2];
      m3 += p * p[3];
    }
  }
  SEXTANT_STORE(moments, m0);
  SEXTANT_STORE(moments + 4, m1);
  SEXTANT_STORE(moments + 8, m2);
  SEXTANT_STORE(moments + 12, m3);
}

/// Points by cell of at least `side` px, cells row by row.
class CellGrid {
 public:
  CellGrid(const std::vector<Point>& points, double side) {
    const PixelExtent extent(points);
    // Few points far apart need no grid as fine as that.
    const double per_side = 1 / std::max({side, extent.width() / max_columns, extent.height() / max_columns});
    columns_ = static_cast<size_t>(extent.width() * per_side) + 1;
    rows_ = static_cast<size_t>(extent.height() * per_side) + 1;
    begin_.assign(columns_ * rows_ + 2, 0);
    std::vector<uint32_t> cells(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      const auto row = static_cast<size_t>((points[i].v - extent.min_v) * per_side);
      const auto column = static_cast<size_t>((points[i].u - extent.min_u) * per_side);
      cells[i] = static_cast<uint32_t>(row * columns_ + column);
      ++begin_[cells[i] + 2];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    members_.resize(points.size());
    order_.resize(points.size());
    cells_.resize(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      const uint32_t to = begin_[cells[i] + 1]++;  // ends as the next cell's beginning
      members_[to] = points[i];
      order_[to] = static_cast<uint32_t>(i);
      cells_[to] = cells[i];
    }
  }

  size_t size() const { return members_.size(); }
  /// Which of the points given member k is.
  size_t index(size_t k) const { return order_[k]; }
  const Point& member(size_t k) const { return members_[k]; }
  /// One after the last member of member k's cell.
  size_t end_of_cell(size_t k) const { return begin_[cells_[k] + 1]; }
  /// The points of the nine cells around member k.
  Rows around(size_t k) const {
    const size_t row = cells_[k] / columns_;
    const size_t column = cells_[k] % columns_;
    Rows rows;
    for (size_t y = row > 0 ? row - 1 : 0; y <= std::min(row + 1, rows_ - 1); ++y) {
      const size_t first = y * columns_ + (column > 0 ? column - 1 : 0);
      const size_t last = y * columns_ + std::min(column + 1, columns_ - 1);
      rows[y + 1 - row] = {members_.data() + begin_[first], begin_[last + 1] - begin_[first]};
    }
    return rows;
  }

 private:
  size_t columns_ = 0, rows_ = 0;
  std::vector<uint32_t> begin_;  ///< first member, by cell
  std::vector<Point> members_;
  std::vector<uint32_t> order_, cells_;
};

LocalPlane fit_plane(const Eigen::Matrix4d& moments, double kappa) {
  const double n = moments(0, 0);
  const Eigen::Vector3d sum = moments.col(0).tail<3>();
  const Eigen::Matrix3d c = moments.bottomRightCorner<3, 3>() - sum * sum.transpose() / n;
  const double determinant = c(0, 0) * c(1, 1) - c(0, 1) * c(0, 1);
  if (!(determinant > 1e-3 * c(0, 0) * c(1, 1))) return {};
  const double slope_u = (c(0, 2) * c(1, 1) - c(1, 2) * c(0, 1)) / determinant;
  const double slope_v = (c(1, 2) * c(0, 0) - c(0, 2) * c(0, 1)) / determinant;
  const double dof = n - 3;
  const double residual = (c(2, 2) - slope_u * c(0, 2) - slope_v * c(1, 2)) / (kappa * kappa);
  const bool agrees = residual <= dof + 2.33 * std::sqrt(2 * dof);
  return {true, slope_u, slope_v, agrees ? 0 : (residual / dof - 1) * kappa * kappa};
}

}  // namespace

std::vector<LocalPlane> fit_local_planes(const Correspondences& points, double kappa, double radius_px) {
  std::vector<LocalPlane> planes(points.size());
  std::vector<Point> valid;
  std::vector<uint32_t> index;
  valid.reserve(points.size());
  index.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    if (points.depth[i] > 0 && std::isfinite(points.depth[i]) && std::abs(points.u[i]) < max_pixel &&
        std::abs(points.v[i]) < max_pixel) {
      valid.push_back({1, points.u[i], points.v[i], 1 / points.depth[i]});
      index.push_back(static_cast<uint32_t>(i));
    }
  }
  if (valid.size() < min_neighbours || !(kappa > 0)) return planes;
  const CellGrid grid(valid, 2 * radius_px / 3);
  for (size_t k = 0; k < grid.size();) {
    const size_t end = grid.end_of_cell(k);
    const Rows rows = grid.around(k);
    if (rows[0].size() + rows[1].size() + rows[2].size() < min_neighbours) {
      k = end;
      continue;
    }
    Eigen::Matrix4d moments;
    sum_moments(rows, grid.member(k), moments.data());
    const LocalPlane plane = fit_plane(moments, kappa);
    for (; k < end; ++k) planes[index[grid.index(k)]] = plane;
  }
  return planes;
}

}  // namespace sextant
