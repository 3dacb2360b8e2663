#include "sextant/estimator/solvers/correlated_errors.h"

#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

constexpr int n_unknowns = ErrorScore::n_unknowns;
constexpr int n_products = n_unknowns * (n_unknowns + 1) / 2;
constexpr size_t few_cells = 150;  // sums over their pairs are as fast as over nodes

using Unknowns = std::array<Lanes, n_unknowns>;

double total(const Lanes& lanes) { return sum_of_lanes(&lanes); }

SEXTANT_SIMD void add_products(const Unknowns* values, size_t n, double* products) {
  Lanes sums[n_products] = {};
  for (size_t i = 0; i < n; ++i) {
    const auto* at = reinterpret_cast<const double*>(values + i);
    Lanes row[n_unknowns];
    for (int a = 0; a < n_unknowns; ++a) row[a] = SEXTANT_LOAD(at + a * n_lanes);
    int k = 0;
    for (int a = 0; a < n_unknowns; ++a) {
      for (int b = a; b < n_unknowns; ++b) sums[k++] += row[a] * row[b];
    }
  }
  for (int k = 0; k < n_products; ++k) products[k] = sum_of_lanes(&sums[k]);
}

ScoreMatrix sum_of_products(const std::vector<Unknowns>& values) {
  double products[n_products];
  add_products(values.data(), values.size(), products);
  ScoreMatrix out;
  int k = 0;
  for (int a = 0; a < n_unknowns; ++a) {
    for (int b = a; b < n_unknowns; ++b) out(a, b) = out(b, a) = products[k++];
  }
  return out;
}

/// Quadratic B-spline at the three nodes around x (in spacings), of unit norm. Returns the first node.
int spline(double x, double* weights) {
  const double nearest = std::round(x);
  const double t = x - nearest;
  weights[0] = 0.5 * (0.5 - t) * (0.5 - t);
  weights[1] = 0.75 - t * t;
  weights[2] = 0.5 * (0.5 + t) * (0.5 + t);
  const double norm =
      1 / std::sqrt(weights[0] * weights[0] + weights[1] * weights[1] + weights[2] * weights[2]);
  for (int k = 0; k < 3; ++k) weights[k] *= norm;
  return static_cast<int>(nearest) - 1;
}

/// to += scale * from, `rows` lanes each.
SEXTANT_SIMD void add_scaled(const Lanes* from, double scale, int rows, Lanes* to) {
  const auto* read = reinterpret_cast<const double*>(from);
  auto* write = reinterpret_cast<double*>(to);
  for (int a = 0; a < rows; ++a, read += n_lanes, write += n_lanes)
    SEXTANT_STORE(write, SEXTANT_LOAD(write) + scale * SEXTANT_LOAD(read));
}

/// Sums that get a place when something is first added to them, on a grid.
class SparseGrid {
 public:
  SparseGrid(size_t columns, size_t rows, size_t expected) : columns_(columns), place_(columns * rows, 0) {
    sums_.reserve(std::min(expected, columns * rows));
  }
  void add(size_t column, size_t row, const Lanes* values, double scale) {
    uint32_t& at = place_[row * columns_ + column];
    if (at == 0) {
      sums_.push_back({});
      where_.push_back({column, row});
      at = static_cast<uint32_t>(sums_.size());
    }
    add_scaled(values, scale, n_unknowns, sums_[at - 1].data());
  }
  const std::vector<Unknowns>& sums() const { return sums_; }
  const std::array<size_t, 2>& where(size_t k) const { return where_[k]; }

 private:
  size_t columns_;
  std::vector<uint32_t> place_;
  std::vector<Unknowns> sums_;
  std::vector<std::array<size_t, 2>> where_;
};

/// sum_ij exp(-|c_i - c_j|^2 / (2 length^2)) S_i^T S_j over cells; length in cells.
ScoreMatrix sum_over_pairs(const SparseGrid& cells, double length) {
  const std::vector<Unknowns>& sums = cells.sums();
  // Both coordinates are whole numbers: a table has every value of the separable kernel.
  size_t most = 0;
  for (size_t k = 0; k < sums.size(); ++k) most = std::max({most, cells.where(k)[0], cells.where(k)[1]});
  std::vector<double> kernel;
  for (size_t d = 0; d <= most; ++d)
    kernel.push_back(std::exp(-0.5 * std::pow(static_cast<double>(d) / length, 2)));
  const auto distance = [](size_t a, size_t b) { return a > b ? a - b : b - a; };
  ScoreMatrix out = ScoreMatrix::Zero();
  for (size_t i = 0; i < sums.size(); ++i) {
    Unknowns seen = {};
    for (size_t j = 0; j < sums.size(); ++j) {
      const double rho = kernel[distance(cells.where(i)[0], cells.where(j)[0])] *
                         kernel[distance(cells.where(i)[1], cells.where(j)[1])];
      add_scaled(sums[j].data(), rho, n_unknowns, seen.data());
    }
    for (int a = 0; a < n_unknowns; ++a) {
      for (int b = a; b < n_unknowns; ++b) out(a, b) += total(sums[i][a] * seen[b]);
    }
  }
  out.triangularView<Eigen::StrictlyLower>() = out.transpose();
  return out;
}

/// M_k of one length. Points of a cell, much smaller than the length or the body, count as at its centre. That
/// widens the correlation by the variance of two uniform errors; the nodes lie closer by as much.
ScoreMatrix scores_of_length(const std::vector<ErrorScore>& points, double length_px) {
  constexpr double most_columns = 4096, fewest_columns = 16;
  double min_u = INFINITY, min_v = INFINITY, max_u = -INFINITY, max_v = -INFINITY;
  for (const ErrorScore& p : points) {
    min_u = std::min(min_u, p.u), max_u = std::max(max_u, p.u);
    min_v = std::min(min_v, p.v), max_v = std::max(max_v, p.v);
  }
  const double extent = std::max(max_u - min_u, max_v - min_v);
  if (!(extent < 1e9)) return independent_scores(points);  // no image: nothing is near anything
  double cell = 0.5 * length_px;
  if (extent > 0) cell = std::clamp(cell, extent / most_columns, extent / fewest_columns);
  const auto cells = [&](double range) { return static_cast<size_t>(range / cell) + 1; };
  SparseGrid of_cells(cells(max_u - min_u), cells(max_v - min_v), points.size());
  for (const ErrorScore& p : points) {
    of_cells.add(static_cast<size_t>((p.u - min_u) / cell), static_cast<size_t>((p.v - min_v) / cell),
                 p.derivative, 1);
  }
  const double relative = std::max(length_px / cell, 1.0);
  if (of_cells.sums().size() <= few_cells) return sum_over_pairs(of_cells, relative);
  const double spacing = std::sqrt(2 * (relative * relative - 1.0 / 6));  // in cells
  const auto nodes = [&](double range) {
    return static_cast<size_t>(static_cast<double>(cells(range)) / spacing) + 4;
  };
  SparseGrid of_nodes(nodes(max_u - min_u), nodes(max_v - min_v), 4 * of_cells.sums().size());
  for (size_t k = 0; k < of_cells.sums().size(); ++k) {
    double across[3], down[3];
    const auto [x, y] = of_cells.where(k);
    const auto column = static_cast<size_t>(spline(static_cast<double>(x) / spacing, across) + 1);
    const auto row = static_cast<size_t>(spline(static_cast<double>(y) / spacing, down) + 1);
    for (size_t j = 0; j < 3; ++j) {
      for (size_t i = 0; i < 3; ++i)
        of_nodes.add(column + i, row + j, of_cells.sums()[k].data(), across[i] * down[j]);
    }
  }
  return sum_of_products(of_nodes.sums());
}

}  // namespace

void ErrorScore::eliminate_depth() {
  for (Lanes& row : derivative) row -= by_depth * total(by_depth * row);
  residual -= by_depth * total(by_depth * residual);
}

ScoreMatrix correlated_scores(const std::vector<ErrorScore>& points,
                              const std::vector<SpatialCorrelation::Part>& parts) {
  ScoreMatrix sum = ScoreMatrix::Zero();
  if (points.empty()) return sum;
  for (const SpatialCorrelation::Part& part : parts)
    sum += part.share * scores_of_length(points, part.length_px);
  return sum;
}

ScoreMatrix independent_scores(const std::vector<ErrorScore>& points) {
  std::vector<Unknowns> values(points.size());
  for (size_t i = 0; i < points.size(); ++i) std::copy_n(points[i].derivative, n_unknowns, values[i].begin());
  return sum_of_products(values);
}

}  // namespace sextant
