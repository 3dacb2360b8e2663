#include "sextant/estimator/flow_depth/correlated_weights.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "sextant/estimator/flow_depth/correlated_errors.h"

namespace sextant {
namespace {

/// Computes L, and below it (L^-1 B)^T, four columns at a time.
SEXTANT_SIMD bool factorize(double* values, size_t n, size_t n_rows) {
  for (size_t block = 0; block < n; block += n_lanes) {
    double* const columns = values + block * n_rows;
    // Subtracts the contribution of the previous columns.
    for (size_t row = block; row < n_rows; row += n_lanes) {
      Lanes sum[n_lanes];
      for (size_t c = 0; c < n_lanes; ++c) sum[c] = SEXTANT_LOAD(columns + c * n_rows + row);
      const double* before = values;
      for (size_t k = 0; k < block; ++k, before += n_rows) {
        const Lanes own = SEXTANT_LOAD(before + row);
        for (size_t c = 0; c < n_lanes; ++c) sum[c] -= own * before[block + c];
      }
      for (size_t c = 0; c < n_lanes; ++c) SEXTANT_STORE(columns + c * n_rows + row, sum[c]);
    }
    for (size_t c = 0; c < n_lanes; ++c) {
      double* const column = columns + c * n_rows;
      const double pivot = column[block + c];
      if (!(pivot > 0)) return false;
      const double scale = 1 / std::sqrt(pivot);
      for (size_t row = block; row < n_rows; row += n_lanes)
        SEXTANT_STORE(column + row, SEXTANT_LOAD(column + row) * scale);
      for (size_t d = c + 1; d < n_lanes; ++d) {
        const double factor = column[block + d];
        double* const other = columns + d * n_rows;
        for (size_t row = block; row < n_rows; row += n_lanes)
          SEXTANT_STORE(other + row, SEXTANT_LOAD(other + row) - factor * SEXTANT_LOAD(column + row));
      }
    }
  }
  return true;
}

/// Computes X^T from (L^-1 B)^T.
SEXTANT_SIMD void substitute_back(double* values, size_t n, size_t n_rows) {
  for (size_t k = n; k-- > 0;) {
    const double* const column = values + k * n_rows;
    double* const own = values + k * n_rows + n;
    Lanes first = SEXTANT_LOAD(own), second = SEXTANT_LOAD(own + n_lanes);
    for (size_t row = k + 1; row < n; ++row) {
      const double* const known = values + row * n_rows + n;
      first -= column[row] * SEXTANT_LOAD(known);
      second -= column[row] * SEXTANT_LOAD(known + n_lanes);
    }
    SEXTANT_STORE(own, first / column[k]);
    SEXTANT_STORE(own + n_lanes, second / column[k]);
  }
}

}  // namespace

PositiveDefiniteSystem::PositiveDefiniteSystem(size_t n_unknowns)
    : n_padded_((n_unknowns + n_lanes - 1) / n_lanes * n_lanes),
      n_rows_(n_padded_ + max_right_sides),
      values_(n_padded_ * n_rows_, 0.0) {
  for (size_t row = n_unknowns; row < n_padded_; ++row) left(row, row) = 1;
}

bool PositiveDefiniteSystem::solve() {
  if (!factorize(values_.data(), n_padded_, n_rows_)) return false;
  substitute_back(values_.data(), n_padded_, n_rows_);
  return true;
}

namespace {

constexpr int n_weighed = ErrorScore::n_unknowns;
constexpr int n_twist = 6;
constexpr double most_cells = 24;
using Matrix = Eigen::MatrixXd;

/// Weight matrix W of a point.
struct alignas(lane_bytes) PointWeight {
  Lanes information, along;  ///< W = diag(information) - along along^T

  SEXTANT_INLINED PointWeight(const ErrorScore& point, const Lanes& per_independent)
      : information(point.measured * per_independent), along(information * point.by_depth) {
    const Lanes squares = along * point.by_depth;
    const double length = sum_of_lanes(&squares);
    if (length > 0) along *= 1 / std::sqrt(length);
  }
  SEXTANT_INLINED void times(const Lanes& column, Lanes& product) const {
    const Lanes products = along * column;
    product = information * column - along * sum_of_lanes(&products);
  }
};

/// Square cells over the points: at most most_cells, and only those that contain points.
struct Cells {
  double side = 1;
  std::vector<double> u, v;  ///< centres
  std::vector<size_t> of_point;

  explicit Cells(const std::vector<ErrorScore>& points) {
    const PixelExtent extent(points);
    if (!extent.is_of_an_image()) {
      side = INFINITY;  // a single cell, in which all errors are independent
      u = v = {0};
      of_point.assign(points.size(), 0);
      return;
    }
    // (width / side + 1) (height / side + 1) = most_cells
    const double width = extent.width(), height = extent.height(), sum = width + height;
    side = (sum + std::sqrt(sum * sum + 4 * width * height * (most_cells - 1))) / (2 * (most_cells - 1));
    side = std::max(side, 1e-3);
    const double per_px = 1 / side;
    const auto n_columns = static_cast<size_t>(width * per_px) + 1;
    std::vector<size_t> number(n_columns * (static_cast<size_t>(height * per_px) + 1), 0);  // from 1
    of_point.reserve(points.size());
    for (const ErrorScore& p : points) {
      const auto column = static_cast<size_t>((p.u - extent.min_u) * per_px),
                 row = static_cast<size_t>((p.v - extent.min_v) * per_px);
      size_t& cell = number[row * n_columns + column];
      if (cell == 0) {
        u.push_back((static_cast<double>(column) + 0.5) * side);
        v.push_back((static_cast<double>(row) + 0.5) * side);
        cell = u.size();
      }
      of_point.push_back(cell - 1);
    }
  }
  size_t size() const { return u.size(); }
  /// Returns f of a length.
  double height_of(double length_px) const {
    return length_px * length_px / (length_px * length_px + side * side / 6);
  }
  /// Returns K^-1; a share of 1e-9 of each variance is independent between cells.
  Matrix inverse_correlation(const std::vector<SpatialCorrelation::Part>& parts) const {
    const auto n = static_cast<Eigen::Index>(size());
    Matrix K(n, n);
    for (size_t a = 0; a < size(); ++a) {
      for (size_t b = 0; b <= a; ++b) {
        const double squared = std::pow(u[a] - u[b], 2) + std::pow(v[a] - v[b], 2);
        double sum = a == b ? 1e-9 : 0;
        for (const SpatialCorrelation::Part& part : parts) {
          const double f = height_of(part.length_px);
          sum += part.share * f * std::exp(-0.5 * f * squared / (part.length_px * part.length_px));
        }
        K(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) = sum;
      }
    }
    return K.llt().solve(Matrix::Identity(n, n));
  }
};

/// Sums over a cell of W and of W D.
struct alignas(lane_bytes) CellSums {
  Lanes weight[n_lanes] = {};
  Lanes weighted[n_weighed] = {};
};

/// Adds W of each point to its cell; returns the trace of sum_i D_i^T W_i D_i over that of sum_i D_i^T D_i.
SEXTANT_SIMD double add_to_cells(const std::vector<ErrorScore>& points, const std::vector<size_t>& cell_of,
                                 const Lanes& per_independent, CellSums* cells,
                                 std::vector<PointWeight>& weights) {
  Lanes plain = {}, weighted = {};
  for (size_t i = 0; i < points.size(); ++i) {
    const PointWeight& W = weights.emplace_back(points[i], per_independent);
    CellSums& sum = cells[cell_of[i]];
    for (size_t c = 0; c < n_lanes; ++c) {
      sum.weight[c] -= W.along[c] * W.along;
      sum.weight[c][c] += W.information[c];
    }
    for (int a = 0; a < n_weighed; ++a) {
      const Lanes& D = points[i].derivative[a];
      Lanes product;
      W.times(D, product);
      sum.weighted[a] += product;
      if (a >= n_twist) continue;
      plain += D * D;
      weighted += D * product;
    }
  }
  const double all = sum_of_lanes(&plain);
  return all > 0 ? sum_of_lanes(&weighted) / all : 0;
}

/// F of a cell, by unknown.
struct alignas(lane_bytes) Smooth {
  Lanes by[n_weighed] = {};
};

SEXTANT_SIMD void turn_into_scores(const std::vector<size_t>& cell_of, const PointWeight* weights,
                                   const Smooth* smooth, double of_each, std::vector<ErrorScore>& points,
                                   WeightedEquations& out) {
  Lanes curvature[n_weighed][n_weighed] = {};  // symmetric after summation
  Lanes gradient[n_weighed] = {};
  for (size_t i = 0; i < points.size(); ++i) {
    const PointWeight& W = weights[i];
    const Smooth& F = smooth[cell_of[i]];
    Lanes G[n_weighed];
    for (int a = 0; a < n_weighed; ++a) {
      W.times(points[i].derivative[a] - F.by[a], G[a]);
      G[a] *= of_each;
      for (int b = 0; b <= a; ++b) curvature[a][b] += G[a] * points[i].derivative[b];
      gradient[a] += G[a] * points[i].residual;
    }
    std::copy_n(G, n_weighed, points[i].derivative);
  }
  for (int a = 0; a < n_weighed; ++a) {
    out.gradient[a] = sum_of_lanes(&gradient[a]);
    for (int b = 0; b <= a; ++b) out.curvature(a, b) = out.curvature(b, a) = sum_of_lanes(&curvature[a][b]);
  }
}

/// Solves for F of these channels in every cell: (K^-1 + sum(W)) F = sum(W D).
void take_smooth_part(const Matrix& K_inverse, const std::vector<CellSums>& sums, const Lanes& variances,
                      const std::vector<size_t>& channels, std::vector<Smooth>& out) {
  const size_t m = sums.size();
  PositiveDefiniteSystem system(m * channels.size());
  for (size_t a = 0; a < channels.size(); ++a) {
    const size_t c = channels[a], row = a * m;
    const double per_variance = 1 / variances[c];
    for (size_t k = 0; k < m; ++k) {
      const double* const column = K_inverse.col(static_cast<Eigen::Index>(k)).data();
      for (size_t l = k; l < m; ++l) system.left(row + l, row + k) = per_variance * column[l];
      const CellSums& sum = sums[k];
      for (size_t b = 0; b <= a; ++b) system.left(row + k, b * m + k) += sum.weight[c][channels[b]];
      for (size_t b = 0; b < n_weighed; ++b) system.right(row + k, b) = sum.weighted[b][c];
    }
  }
  if (!system.solve()) return;  // F stays 0: the weights are suboptimal, but valid
  for (size_t a = 0; a < channels.size(); ++a) {
    for (size_t k = 0; k < m; ++k) {
      for (size_t b = 0; b < n_weighed; ++b) out[k].by[b][channels[a]] = system.right(a * m + k, b);
    }
  }
}

/// Returns true if depths couple the channels.
bool are_coupled(const std::vector<CellSums>& sums) {
  return std::any_of(sums.begin(), sums.end(), [](const CellSums& sum) {
    for (size_t a = 0; a < n_lanes; ++a) {
      for (size_t b = 0; b < a; ++b) {
        if (sum.weight[a][b] != 0) return true;
      }
    }
    return false;
  });
}

/// Returns F of every cell.
std::vector<Smooth> smooth_part(const Cells& cells, const std::vector<CellSums>& sums,
                                const ErrorParts& errors) {
  std::vector<Smooth> out(cells.size());
  std::vector<size_t> channels;
  for (size_t c = 0; c < n_lanes; ++c) {
    if (errors.correlated[c] > 0) channels.push_back(c);
  }
  if (channels.empty()) return out;
  const Matrix K_inverse = cells.inverse_correlation(errors.shape);
  if (are_coupled(sums)) {
    take_smooth_part(K_inverse, sums, errors.correlated, channels, out);
  } else {
    for (const size_t channel : channels)
      take_smooth_part(K_inverse, sums, errors.correlated, {channel}, out);
  }
  return out;
}

}  // namespace

WeightedEquations weigh(std::vector<ErrorScore>& points, const ErrorParts& errors, double of_each) {
  WeightedEquations out;
  if (points.empty()) return out;
  const Cells cells(points);
  const double of_a_cell = static_cast<double>(points.size()) / static_cast<double>(cells.size());
  double within = 0;
  for (const SpatialCorrelation::Part& part : errors.shape) {
    const double f = cells.height_of(part.length_px);
    within += part.share * (1 - f + (of_a_cell - 1) * std::min(f, 1 - f));
  }
  constexpr double least = 1e-3;  // with a variance of 0 one channel would dominate all others
  Lanes independent = errors.independent + within * errors.correlated;
  for (size_t c = 0; c < n_lanes; ++c) independent[c] = std::max(independent[c], least);
  std::vector<CellSums> sums(cells.size());
  std::vector<PointWeight> weights;
  weights.reserve(points.size());
  alignas(lane_bytes) const Lanes per_independent = 1.0 / independent;
  out.independent = add_to_cells(points, cells.of_point, per_independent, sums.data(), weights);
  turn_into_scores(cells.of_point, weights.data(), smooth_part(cells, sums, errors).data(), of_each, points,
                   out);
  return out;
}

}  // namespace sextant
