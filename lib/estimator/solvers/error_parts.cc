#include "sextant/estimator/solvers/error_parts.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace sextant {
namespace {

constexpr int n_motion = 6;
constexpr size_t parts_sample = 100;

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
      for (int b = a; b < n_motion; ++b) H(a, b) += added(p->derivative[a] * p->derivative[b]);
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

}  // namespace sextant
