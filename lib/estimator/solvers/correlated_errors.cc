#include "sextant/estimator/solvers/correlated_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

constexpr int n_unknowns = ErrorScore::n_unknowns;
constexpr int n_motion = 6;
constexpr int n_products = n_unknowns * (n_unknowns + 1) / 2;
constexpr size_t few_cells = 150;  // sums over their pairs are as fast as over nodes
constexpr size_t parts_sample = 100;

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
  SparseGrid(size_t columns, size_t rows) : columns_(columns), place_(columns * rows, 0) {}
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
  double cell = 0.5 * length_px;
  if (extent > 0) cell = std::clamp(cell, extent / most_columns, extent / fewest_columns);
  const auto cells = [&](double range) { return static_cast<size_t>(range / cell) + 1; };
  SparseGrid of_cells(cells(max_u - min_u), cells(max_v - min_v));
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
  SparseGrid of_nodes(nodes(max_u - min_u), nodes(max_v - min_v));
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

// ---- the parts from the residuals

/// In ratios of four, the longest first: exp(-r^2 / (2 L^2)) of the next is the 16th power of one.
constexpr std::array<double, 3> lengths_px = {160, 40, 10};
constexpr int n_parts = 1 + static_cast<int>(lengths_px.size());  // and the independent one

/// Of two points so many pixels apart along one axis, for the longest length.
const std::vector<double>& longest_kernel() {
  static const std::vector<double> table = [] {
    std::vector<double> values;
    for (int d = 0; d < 6 * lengths_px[0]; ++d)
      values.push_back(std::exp(-0.5 * std::pow(d / lengths_px[0], 2)));
    values.push_back(0);
    return values;
  }();
  return table;
}

std::array<double, n_parts> kernels_at(const std::vector<double>& longest, double du, double dv) {
  const auto last = static_cast<double>(longest.size() - 1);
  const auto at = [&](double d) { return longest[static_cast<size_t>(std::min(std::abs(d) + 0.5, last))]; };
  std::array<double, n_parts> out{};
  out[1] = at(du) * at(dv);
  for (int k = 2; k < n_parts; ++k) {
    out[k] = out[k - 1];
    for (int square = 0; square < 4; ++square) out[k] *= out[k];
  }
  return out;
}

using PartsMatrix = Eigen::Matrix<double, n_parts, n_parts>;
using PartsVector = Eigen::Matrix<double, n_parts, 1>;
using MotionRows = std::array<Lanes, n_motion>;

/// T_a = y^T K_a y and S_ab = tr(K_a R K_b R), R the projection that leaves residuals of a fit: E[T] = S variances.
struct QuadraticForms {
  PartsVector T = PartsVector::Zero();
  PartsMatrix S = PartsMatrix::Zero();
};

/// tr(Pi_i Pi_j) of what the depths leave of two points' channels.
double common_trace(const ErrorScore& a, const ErrorScore& b) {
  const Lanes both = a.measured * b.measured;
  const double dot = total(a.by_depth * b.by_depth);
  return total(both * (1.0 - a.by_depth * a.by_depth - b.by_depth * b.by_depth)) + dot * dot;
}

bool quadratic_forms(const std::vector<const ErrorScore*>& points, QuadraticForms& out) {
  const size_t n = points.size();
  // Q: orthonormal columns that the motion's derivatives span.
  Matrix6d H = Matrix6d::Zero();
  for (const ErrorScore* p : points) {
    for (int a = 0; a < n_motion; ++a) {
      for (int b = a; b < n_motion; ++b) H(a, b) += total(p->derivative[a] * p->derivative[b]);
    }
  }
  H.triangularView<Eigen::StrictlyLower>() = H.transpose();
  const Eigen::LLT<Matrix6d> factor(H);
  if (factor.info() != Eigen::Success) return false;
  const Matrix6d to_q = factor.matrixL().solve(Matrix6d::Identity());
  std::vector<MotionRows> Q(n, MotionRows{});
  for (size_t i = 0; i < n; ++i) {
    for (int a = 0; a < n_motion; ++a) {
      for (int b = 0; b <= a; ++b) Q[i][a] += to_q(a, b) * points[i]->derivative[b];
    }
  }
  const std::vector<double>& longest = longest_kernel();
  std::array<std::vector<MotionRows>, n_parts> KQ;
  KQ.fill(Q);
  for (size_t i = 0; i < n; ++i) {
    const ErrorScore& p = *points[i];
    const double squared = total(p.residual * p.residual);
    const double trace = common_trace(p, p);
    out.T.array() += squared;
    out.S.array() += trace;
    for (size_t j = 0; j < i; ++j) {
      const ErrorScore& q = *points[j];
      const std::array<double, n_parts> K = kernels_at(longest, p.u - q.u, p.v - q.v);
      const double product = 2 * total(p.residual * q.residual);
      const double pair_trace = 2 * common_trace(p, q);
      for (int a = 1; a < n_parts && K[a] > 1e-5; ++a) {
        out.T[a] += K[a] * product;
        for (int b = 1; b < n_parts; ++b) out.S(a, b) += K[a] * K[b] * pair_trace;
        add_scaled(Q[j].data(), K[a], n_motion, KQ[a][i].data());
        add_scaled(Q[i].data(), K[a], n_motion, KQ[a][j].data());
      }
    }
  }
  using Square = std::array<std::array<Lanes, n_motion>, n_motion>;
  std::array<Square, n_parts> lanes_QKQ{};
  std::array<std::array<Lanes, n_parts>, n_parts> lanes_crossed{};
  for (size_t i = 0; i < n; ++i) {
    const Lanes& depth = points[i]->by_depth;
    for (int a = 0; a < n_parts; ++a) {
      for (Lanes& row : KQ[a][i]) row = points[i]->measured * (row - depth * total(depth * row));
      for (int d = 0; d < n_motion; ++d) {
        for (int e = 0; e < n_motion; ++e) lanes_QKQ[a][d][e] += Q[i][d] * KQ[a][i][e];
        for (int b = 0; b <= a; ++b) lanes_crossed[a][b] += KQ[a][i][d] * KQ[b][i][d];
      }
    }
  }
  std::array<Matrix6d, n_parts> QKQ;
  for (int a = 0; a < n_parts; ++a) {
    for (int d = 0; d < n_motion; ++d) {
      for (int e = 0; e < n_motion; ++e) QKQ[a](d, e) = total(lanes_QKQ[a][d][e]);
    }
    for (int b = 0; b <= a; ++b) {
      out.S(a, b) += (QKQ[a].cwiseProduct(QKQ[b].transpose())).sum() - 2 * total(lanes_crossed[a][b]);
      out.S(b, a) = out.S(a, b);
    }
  }
  return true;
}

/// Variances >= 0 of the parts in `among` (bits), and their standard deviations if the errors were independent;
/// the least squares solution over all subsets of them.
PartsVector non_negative(const QuadraticForms& forms, unsigned among, PartsVector& deviations) {
  PartsVector best = PartsVector::Zero();
  double least = INFINITY;
  for (unsigned subset = 1; subset < 1U << n_parts; ++subset) {
    if ((subset & among) != subset) continue;
    PartsMatrix S = PartsMatrix::Identity();
    PartsVector T = PartsVector::Zero();
    for (int a = 0; a < n_parts; ++a) {
      if ((subset >> a & 1U) == 0) continue;
      T[a] = forms.T[a];
      for (int b = 0; b < n_parts; ++b) {
        if ((subset >> b & 1U) != 0) S(a, b) = forms.S(a, b);
      }
    }
    const Eigen::LLT<PartsMatrix> factor(S);
    if (factor.info() != Eigen::Success) continue;
    const PartsVector x = factor.solve(T);
    if ((x.array() < 0).any() || !x.allFinite() || -x.dot(T) >= least) continue;
    least = -x.dot(T);
    best = x;
    const PartsMatrix inverse = factor.solve(PartsMatrix::Identity());
    deviations = (2 * inverse.diagonal()).cwiseSqrt() * x.sum();
  }
  return best;
}

}  // namespace

void ErrorScore::eliminate_depth() {
  for (Lanes& row : derivative) row -= by_depth * total(by_depth * row);
  residual -= by_depth * total(by_depth * residual);
}

ErrorParts estimate_error_parts(const std::vector<ErrorScore>& points) {
  constexpr double significant = 3;
  ErrorParts out;
  const size_t n = std::min(points.size(), parts_sample);
  std::vector<const ErrorScore*> sample;
  for (size_t i = 0; i < n; ++i) sample.push_back(&points[i * points.size() / n]);
  QuadraticForms forms;
  if (sample.size() < 2 * n_motion || !quadratic_forms(sample, forms)) return out;
  unsigned among = (1U << n_parts) - 1;
  PartsVector deviations;
  PartsVector variances = non_negative(forms, among, deviations);
  for (;;) {
    int weakest = 0;
    double least = significant;
    for (int a = 1; a < n_parts; ++a) {
      if (variances[a] > 0 && variances[a] < least * deviations[a]) {
        least = variances[a] / deviations[a];
        weakest = a;
      }
    }
    if (weakest == 0) break;
    among &= ~(1U << weakest);
    variances = non_negative(forms, among, deviations);
  }
  out.independent = variances[0];
  for (int a = 1; a < n_parts; ++a) {
    if (variances[a] > 0) out.correlated.push_back({lengths_px[static_cast<size_t>(a) - 1], variances[a]});
  }
  return out;
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
