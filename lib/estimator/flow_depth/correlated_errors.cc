#include "sextant/estimator/flow_depth/correlated_errors.h"

#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

constexpr int n_unknowns = ErrorScore::n_unknowns;

/// Size of the row of one score, in whole lanes of float: precise to 1e-6 of a sum of thousands.
constexpr size_t row_size = 32;
constexpr size_t float_lanes = LaneTypes<float>::n;
constexpr size_t row_lanes = row_size / float_lanes;
static_assert(n_unknowns * n_lanes <= row_size);
using ScoreRows = std::vector<float>;

SEXTANT_INLINED void read_row(const float* from, Lanes* row) {
  for (size_t a = 0; a < n_unknowns; ++a) {
    for (size_t c = 0; c < n_lanes; ++c) row[a][c] = static_cast<double>(from[a * n_lanes + c]);
  }
}

/// Computes sums = upper triangle of left^T right, by channel, over n rows.
SEXTANT_SIMD void sum_products(const float* left, const float* right, size_t n, double* sums) {
  Lanes total[ChannelScores::size] = {};
  for (size_t i = 0; i < n; ++i) {
    Lanes row[n_unknowns], other[n_unknowns];
    read_row(left + i * row_size, row);
    if (right != left) read_row(right + i * row_size, other);
    const Lanes* const column = right != left ? other : row;
    int k = 0;
    for (int a = 0; a < n_unknowns; ++a) {
      for (int b = a; b < n_unknowns; ++b) total[k++] += row[a] * column[b];
    }
  }
  for (int k = 0; k < ChannelScores::size; ++k) SEXTANT_STORE(sums + n_lanes * k, total[k]);
}

ChannelScores sum_of_products(const ScoreRows& left, const ScoreRows& right) {
  ChannelScores out;
  sum_products(left.data(), right.data(), left.size() / row_size, out.values);
  return out;
}

/// Computes the quadratic B-spline, with unit norm, at the three nodes around x >= 0 (in spacings). Returns
/// the first node.
int spline(float x, float* weights) {
  const int nearest = static_cast<int>(x + 0.5F);
  const float t = x - static_cast<float>(nearest);
  weights[0] = 0.5F * (0.5F - t) * (0.5F - t);
  weights[1] = 0.75F - t * t;
  weights[2] = 0.5F * (0.5F + t) * (0.5F + t);
  const float norm =
      1 / std::sqrt(weights[0] * weights[0] + weights[1] * weights[1] + weights[2] * weights[2]);
  for (int k = 0; k < 3; ++k) weights[k] *= norm;
  return nearest - 1;
}

/// ScoreRows and their positions in px.
struct Sites {
  std::vector<float> x, y;
  ScoreRows values;
  float width = 0, height = 0;

  size_t size() const { return x.size(); }
};

/// Nodes to which a row is added, with their weights.
template <size_t n>
struct Targets {
  uint32_t row[n];
  float weight[n];
};

template <size_t n>
[[gnu::always_inline]] inline void add_rows(const Targets<n>* targets, size_t count, const float* values,
                                            float* sums) {
  using L = LanesOf<float>;
  for (size_t i = 0; i < count; ++i, ++targets, values += row_size) {
    L value[row_lanes];
    for (size_t a = 0; a < row_lanes; ++a) value[a] = SEXTANT_LOAD(values + a * float_lanes);
    for (size_t k = 0; k < n; ++k) {
      const float weight = targets->weight[k];
      float* to = sums + targets->row[k] * row_size;
      for (size_t a = 0; a < row_lanes; ++a, to += float_lanes)
        SEXTANT_STORE(to, SEXTANT_LOAD(to) + weight * value[a]);
    }
  }
}
SEXTANT_SIMD void add_to_corners(const Targets<4>* targets, size_t count, const float* values, float* sums) {
  add_rows(targets, count, values, sums);
}
SEXTANT_SIMD void add_to_nodes(const Targets<9>* targets, size_t count, const float* values, float* sums) {
  add_rows(targets, count, values, sums);
}

/// Computes out_a = sum_b kernel[|a - b|] in_b along a line of n rows, `step` rows apart.
SEXTANT_SIMD void convolve_line(const float* in, size_t n, size_t step, const float* kernel, float* out) {
  using L = LanesOf<float>;
  for (size_t a = 0; a < n; ++a) {
    L sum[row_lanes] = {};
    for (size_t b = 0; b < n; ++b) {
      const float weight = kernel[a > b ? a - b : b - a];
      const float* from = in + b * step * row_size;
      for (size_t k = 0; k < row_lanes; ++k) sum[k] += weight * SEXTANT_LOAD(from + k * float_lanes);
    }
    for (size_t k = 0; k < row_lanes; ++k) SEXTANT_STORE(out + a * step * row_size + k * float_lanes, sum[k]);
  }
}

/// Returns sum_cc' K(x_c - x_c') K(y_c - y_c') S_c^T S_c' over all pairs of corners of the cells that contain
/// points. A point is distributed linearly over its four corners, which adds side^2 / 3 to the variance of
/// distances; K is narrower and higher to compensate.
ChannelScores sum_over_corners(const Sites& points, float side, float length_px) {
  const float per_px = 1 / side;
  const auto columns = static_cast<uint32_t>(points.width * per_px) + 2;
  const auto rows = static_cast<uint32_t>(points.height * per_px) + 2;
  std::vector<Targets<4>> targets(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    const float x = points.x[i] * per_px, y = points.y[i] * per_px;
    const auto column = static_cast<uint32_t>(x), row = static_cast<uint32_t>(y);
    const float right = x - static_cast<float>(column), down = y - static_cast<float>(row);
    const uint32_t corner = row * columns + column;
    targets[i] = {{corner, corner + 1, corner + columns, corner + columns + 1},
                  {(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down}};
  }
  ScoreRows corners(size_t{columns} * rows * row_size, 0), along(corners.size()), all(corners.size());
  add_to_corners(targets.data(), targets.size(), points.values.data(), corners.data());
  const float variance = length_px * length_px - side * side / 3;
  std::vector<float> kernel;
  for (uint32_t d = 0; d < std::max(columns, rows); ++d) {
    const float distance = static_cast<float>(d) * side;
    kernel.push_back(length_px / std::sqrt(variance) * std::exp(-0.5F * distance * distance / variance));
  }
  for (size_t row = 0; row < rows; ++row) {
    const size_t first = row * columns * row_size;
    convolve_line(&corners[first], columns, 1, kernel.data(), &along[first]);
  }
  for (size_t column = 0; column < columns; ++column)
    convolve_line(&along[column * row_size], rows, columns, kernel.data(), &all[column * row_size]);
  return sum_of_products(corners, all);
}

/// Returns sum_q V_q^T V_q over nodes with this spacing (px).
ChannelScores sum_over_nodes(const Sites& points, float spacing) {
  const float per_px = 1 / spacing;
  const auto columns = static_cast<size_t>(points.width * per_px) + 4;
  std::vector<uint32_t> number(columns * (static_cast<size_t>(points.height * per_px) + 4), 0);
  uint32_t n_nodes = 0;  // nodes with at least one contribution, numbered from 1
  std::vector<Targets<9>> targets(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    float across[3], down[3];
    const auto column = static_cast<size_t>(spline(points.x[i] * per_px, across) + 1);
    const auto row = static_cast<size_t>(spline(points.y[i] * per_px, down) + 1);
    for (size_t k = 0; k < 9; ++k) {
      uint32_t& node = number[(row + k / 3) * columns + column + k % 3];
      if (node == 0) node = ++n_nodes;
      targets[i].row[k] = node - 1;
      targets[i].weight[k] = across[k % 3] * down[k / 3];
    }
  }
  ScoreRows nodes(n_nodes * row_size, 0);
  add_to_nodes(targets.data(), targets.size(), points.values.data(), nodes.data());
  return sum_of_products(nodes, nodes);
}

/// Returns M_k of one length.
ChannelScores scores_of_length(const Sites& points, float length_px) {
  constexpr float cell_of_length = 0.65F;  // accurate to 1 %; smaller cells do not improve on that
  constexpr float fewest_columns = 12, most_columns = 20, most_nodes = 4096;
  constexpr float node_spacing = 1.375F;  // spline and Gaussian have the same integral
  const float extent = std::max(points.width, points.height);
  const float cell = std::min(cell_of_length * length_px, extent / fewest_columns);
  if (extent <= most_columns * cell)
    return sum_over_corners(points, std::max(cell, 1e-3F * length_px), length_px);
  return sum_over_nodes(points, std::max(node_spacing * length_px, extent / most_nodes));
}

SEXTANT_SIMD void copy_rows(const ErrorScore* points, size_t n, float* to) {
  for (size_t i = 0; i < n; ++i, to += row_size) {
    for (size_t a = 0; a < n_unknowns; ++a) {
      for (size_t c = 0; c < n_lanes; ++c)
        to[a * n_lanes + c] = static_cast<float>(points[i].derivative[a][c]);
    }
  }
}
ScoreRows rows_of(const std::vector<ErrorScore>& points) {
  ScoreRows rows(points.size() * row_size, 0);
  copy_rows(points.data(), points.size(), rows.data());
  return rows;
}

}  // namespace

void ChannelScores::add(double share, const ChannelScores& other) {
  for (size_t k = 0; k < std::size(values); ++k) values[k] += share * other.values[k];
}

ScoreMatrix ChannelScores::times(const Lanes& variances) const {
  ScoreMatrix out;
  int k = 0;
  for (int a = 0; a < ErrorScore::n_unknowns; ++a) {
    for (int b = a; b < ErrorScore::n_unknowns; ++b) {
      const Lanes scaled = variances * SEXTANT_LOAD(values + n_lanes * k++);
      out(a, b) = out(b, a) = sum_of_lanes(&scaled);
    }
  }
  return out;
}

ChannelScores correlated_scores(const std::vector<ErrorScore>& points,
                                const std::vector<SpatialCorrelation::Part>& parts) {
  ChannelScores sum;
  if (points.empty() || parts.empty()) return sum;
  const PixelExtent extent(points);
  if (!extent.is_of_an_image()) {
    const ChannelScores alone = independent_scores(points);
    for (const SpatialCorrelation::Part& part : parts) sum.add(part.share, alone);
    return sum;
  }
  Sites sites;
  sites.values = rows_of(points);
  sites.width = static_cast<float>(extent.width());
  sites.height = static_cast<float>(extent.height());
  sites.x.reserve(points.size());
  sites.y.reserve(points.size());
  for (const ErrorScore& p : points) {
    sites.x.push_back(static_cast<float>(p.u - extent.min_u));
    sites.y.push_back(static_cast<float>(p.v - extent.min_v));
  }
  for (const SpatialCorrelation::Part& part : parts)
    sum.add(part.share, scores_of_length(sites, static_cast<float>(part.length_px)));
  return sum;
}

ChannelScores independent_scores(const std::vector<ErrorScore>& points) {
  const ScoreRows rows = rows_of(points);
  return sum_of_products(rows, rows);
}

}  // namespace sextant
