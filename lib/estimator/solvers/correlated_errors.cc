#include "sextant/estimator/solvers/correlated_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

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

// ---- the parts from the residuals

/// T_a = y^T K_a y and S_ab = tr(K_a R K_b R), R the projection that leaves residuals of a fit: E[T] = S variances.
/// Lengths in ratios of four, the longest first: exp(-r^2 / (2 L^2)) of the next is the 16th power of one.
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

using PartsMatrix = Eigen::Matrix<double, n_parts, n_parts>;
using PartsVector = Eigen::Matrix<double, n_parts, 1>;

/// A sample of points, and what the pairs of them add up to.
struct Pairs {
  size_t n;
  std::vector<double> u, v;
  std::vector<double> residual, by_depth, measured;  ///< channels of each point
  std::vector<double> Q;  ///< orthonormal columns that the motion's derivatives span
  std::array<std::vector<double>, n_parts> KQ;
  PartsVector T = PartsVector::Zero();
  PartsMatrix S = PartsMatrix::Zero();
};
constexpr size_t motion_rows = n_motion * n_lanes;  // numbers of Q for one point

[[gnu::always_inline]] inline double added(const Lanes& x) { return (x[0] + x[1]) + (x[2] + x[3]); }

/// T += 2 K_ij y_i . y_j; S += 2 K_ij K'_ij tr(Pi_i Pi_j), Pi: what the depths leave of the channels; KQ.
SEXTANT_SIMD void add_pairs(Pairs& pairs, const double* longest, int last) {
  double T[n_parts] = {};
  double S[n_parts][n_parts] = {};
  const double* const Q = pairs.Q.data();
  for (size_t i = 0; i < pairs.n; ++i) {
    const Lanes y = SEXTANT_LOAD(&pairs.residual[i * n_lanes]);
    const Lanes depth = SEXTANT_LOAD(&pairs.by_depth[i * n_lanes]);
    const Lanes measured = SEXTANT_LOAD(&pairs.measured[i * n_lanes]);
    const Lanes rest = measured - depth * depth;
    const double u = pairs.u[i], v = pairs.v[i];
    Lanes q[n_motion], sums[n_parts][n_motion] = {};
    for (size_t d = 0; d < n_motion; ++d) q[d] = SEXTANT_LOAD(Q + i * motion_rows + d * n_lanes);
    for (size_t j = 0; j < i; ++j) {
      const Lanes product = y * SEXTANT_LOAD(&pairs.residual[j * n_lanes]);
      const Lanes other = SEXTANT_LOAD(&pairs.by_depth[j * n_lanes]);
      const Lanes left = SEXTANT_LOAD(&pairs.measured[j * n_lanes]) * rest - measured * other * other;
      const Lanes both = depth * other;
      const double dot = added(both);
      const double squared = 2 * added(product);
      const double trace = 2 * (added(left) + dot * dot);
      const auto at = [&](double d) {
        return longest[static_cast<int>(std::min(std::abs(d) + 0.5, static_cast<double>(last)))];
      };
      double K = at(u - pairs.u[j]) * at(v - pairs.v[j]);
      double earlier[n_parts] = {};
      for (int a = 1; a < n_parts && K > 1e-5; ++a) {
        earlier[a] = K;
        T[a] += K * squared;
        for (int b = 1; b <= a; ++b) S[a][b] += K * earlier[b] * trace;
        double* there = &pairs.KQ[static_cast<size_t>(a)][j * motion_rows];
        for (size_t d = 0; d < n_motion; ++d) {
          sums[a][d] += K * SEXTANT_LOAD(Q + j * motion_rows + d * n_lanes);
          SEXTANT_STORE(there + d * n_lanes, SEXTANT_LOAD(there + d * n_lanes) + K * q[d]);
        }
        for (int square = 0; square < 4; ++square) K *= K;
      }
    }
    // With itself, every kernel is 1.
    const Lanes own = y * y, left = measured * (rest - depth * depth), both = depth * depth;
    const double dot = added(both);
    for (int a = 0; a < n_parts; ++a) {
      T[a] += added(own);
      for (int b = 0; b <= a; ++b) S[a][b] += added(left) + dot * dot;
      double* here = &pairs.KQ[static_cast<size_t>(a)][i * motion_rows];
      for (size_t d = 0; d < n_motion; ++d)
        SEXTANT_STORE(here + d * n_lanes, SEXTANT_LOAD(here + d * n_lanes) + sums[a][d] + q[d]);
    }
  }
  for (int a = 0; a < n_parts; ++a) {
    pairs.T[a] += T[a];
    for (int b = 0; b <= a; ++b) pairs.S(a, b) += S[a][b];
  }
}

/// S += what the fit has taken out: -2 tr(K_a P K_b Pi) + tr(K_a P K_b P), P = Q Q^T.
SEXTANT_SIMD void add_fit(Pairs& pairs) {
  Lanes QKQ[n_parts][n_motion][n_motion] = {};
  Lanes crossed[n_parts][n_parts] = {};
  for (size_t i = 0; i < pairs.n; ++i) {
    const Lanes depth = SEXTANT_LOAD(&pairs.by_depth[i * n_lanes]);
    const Lanes measured = SEXTANT_LOAD(&pairs.measured[i * n_lanes]);
    Lanes rows[n_parts][n_motion];
    for (int a = 0; a < n_parts; ++a) {
      for (size_t d = 0; d < n_motion; ++d) {
        const Lanes row = SEXTANT_LOAD(&pairs.KQ[static_cast<size_t>(a)][i * motion_rows + d * n_lanes]);
        const Lanes along = depth * row;
        rows[a][d] = measured * (row - depth * added(along));
      }
      for (size_t d = 0; d < n_motion; ++d) {
        const Lanes q = SEXTANT_LOAD(&pairs.Q[i * motion_rows + d * n_lanes]);
        for (int e = 0; e < n_motion; ++e) QKQ[a][d][e] += q * rows[a][e];
        for (int b = 0; b <= a; ++b) crossed[a][b] += rows[a][d] * rows[b][d];
      }
    }
  }
  for (int a = 0; a < n_parts; ++a) {
    for (int b = 0; b <= a; ++b) {
      double sum = -2 * added(crossed[a][b]);
      for (int d = 0; d < n_motion; ++d) {
        for (int e = 0; e < n_motion; ++e) sum += added(QKQ[a][d][e]) * added(QKQ[b][e][d]);
      }
      pairs.S(a, b) += sum;
      pairs.S(b, a) = pairs.S(a, b);
    }
  }
}

std::optional<Pairs> sums_of_pairs(const std::vector<const ErrorScore*>& points) {
  Matrix6d H = Matrix6d::Zero();
  for (const ErrorScore* p : points) {
    for (int a = 0; a < n_motion; ++a) {
      for (int b = a; b < n_motion; ++b) H(a, b) += total(p->derivative[a] * p->derivative[b]);
    }
  }
  H.triangularView<Eigen::StrictlyLower>() = H.transpose();
  const Eigen::LLT<Matrix6d> factor(H);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Matrix6d to_q = factor.matrixL().solve(Matrix6d::Identity());
  Pairs pairs{points.size()};
  const auto put = [](std::vector<double>& to, const Lanes& from) {
    for (size_t k = 0; k < n_lanes; ++k) to.push_back(from[k]);
  };
  for (const ErrorScore* p : points) {
    pairs.u.push_back(p->u);
    pairs.v.push_back(p->v);
    put(pairs.residual, p->residual);
    put(pairs.by_depth, p->by_depth);
    put(pairs.measured, p->measured);
    for (int a = 0; a < n_motion; ++a) {
      Lanes q = {};
      for (int b = 0; b <= a; ++b) q += to_q(a, b) * p->derivative[b];
      put(pairs.Q, q);
    }
  }
  pairs.KQ.fill(std::vector<double>(pairs.Q.size(), 0));
  const std::vector<double>& longest = longest_kernel();
  add_pairs(pairs, longest.data(), static_cast<int>(longest.size()) - 1);
  add_fit(pairs);
  return pairs;
}

/// Variances >= 0 of the parts in `among` (bits), and their standard deviations if the errors were independent;
/// the least squares solution over all subsets of them.
PartsVector non_negative(const Pairs& pairs, unsigned among, PartsVector& deviations) {
  PartsVector best = PartsVector::Zero();
  double least = INFINITY;
  for (unsigned subset = 1; subset < 1U << n_parts; ++subset) {
    if ((subset & among) != subset) continue;
    PartsMatrix S = PartsMatrix::Identity();
    PartsVector T = PartsVector::Zero();
    for (int a = 0; a < n_parts; ++a) {
      if ((subset >> a & 1U) == 0) continue;
      T[a] = pairs.T[a];
      for (int b = 0; b < n_parts; ++b) {
        if ((subset >> b & 1U) != 0) S(a, b) = pairs.S(a, b);
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
  if (sample.size() < 2 * n_motion) return out;
  const std::optional<Pairs> pairs = sums_of_pairs(sample);
  if (!pairs) return out;
  unsigned among = (1U << n_parts) - 1;
  PartsVector deviations;
  PartsVector variances = non_negative(*pairs, among, deviations);
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
    variances = non_negative(*pairs, among, deviations);
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
