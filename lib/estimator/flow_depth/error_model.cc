#include "sextant/estimator/flow_depth/error_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace sextant {
namespace {

constexpr int n_motion = 6;
constexpr size_t parts_sample = 100;
const std::vector<SpatialCorrelation::Part> error_shape = {{20, 0.6}, {100, 0.4}};

/// Kinds of measurements with their own variances, by channel.
constexpr int n_kinds = 3;
constexpr std::array<int, n_lanes> kind_of = {0, 1, 2, 2};
/// Independent and correlated component of each kind.
constexpr int n_parts = 2 * n_kinds;
using PartsMatrix = Eigen::Matrix<double, n_parts, n_parts>;
using PartsVector = Eigen::Matrix<double, n_parts, 1>;

/// Table of the correlation at integer distances in px; 0 at the last one.
const std::vector<float>& shape_table() {
  static const std::vector<float> table = [] {
    const SpatialCorrelation shape{error_shape};
    std::vector<float> values;
    for (int r = 0; r < 500; ++r) values.push_back(static_cast<float>(shape.at(r)));
    values.push_back(0);
    return values;
  }();
  return table;
}

/// Sampled points with four channels each: columns of Q (orthonormal basis of the effect of the motion on the
/// channels), residual y, rows of Pi (projection that eliminates the point's depth). In float.
struct Sample {
  static constexpr size_t Q = 0, y = n_motion * n_lanes, Pi = 32;
  static constexpr size_t width = Pi + n_lanes * n_lanes;
  size_t n = 0;
  float u[parts_sample], v[parts_sample];
  float values[parts_sample * width] = {};
};

/// Sums over points i and j of the sample: index 0 for i = j, index 1 for all pairs weighted by K_ij.
struct alignas(lane_bytes) PairSums {
  Lanes T[2] = {};                      ///< K y y
  Lanes both[2][n_lanes] = {};          ///< K^2 Pi_i Pi_j
  Lanes one[2][2][n_lanes] = {};        ///< Q^T K_a Pi K_b Q, channel of K_a by channel of K_b
  Lanes W[2][n_motion][n_motion] = {};  ///< Q^T K Q
};

/// Reads four of a sample's numbers.
SEXTANT_INLINED void read(const float* from, Lanes& to) {
  for (size_t c = 0; c < n_lanes; ++c) to[c] = static_cast<double>(from[c]);
}

SEXTANT_SIMD void sum_over_pairs(const Sample& sample, const float* shape, float last, PairSums& sums) {
  constexpr size_t lanes = LaneTypes<float>::n, pi = Sample::Pi / lanes, n_sums = Sample::width / lanes;
  for (size_t i = 0; i < sample.n; ++i) {
    const float u = sample.u[i], v = sample.v[i];
    float K[parts_sample];
    for (size_t j = 0; j < sample.n; ++j) {
      const float du = sample.u[j] - u, dv = sample.v[j] - v;
      const float r = std::sqrt(du * du + dv * dv) + 0.5F;
      K[j] = r < last ? r : last;
    }
    for (size_t j = 0; j < sample.n; ++j) K[j] = shape[static_cast<int>(K[j])];
    LanesOf<float> sum[n_sums] = {};
    const float* at = sample.values;
    for (size_t j = 0; j < sample.n; ++j, at += Sample::width) {
      const float once = K[j], twice = once * once;
      for (size_t k = 0; k < n_sums; ++k) sum[k] += (k < pi ? once : twice) * SEXTANT_LOAD(at + k * lanes);
    }
    const float* const own = sample.values + i * Sample::width;
    float all[Sample::width];
    for (size_t k = 0; k < n_sums; ++k) SEXTANT_STORE(all + k * lanes, sum[k]);
    Lanes y, Ky, KQ[2][n_motion];
    read(own + Sample::y, y);
    read(all + Sample::y, Ky);
    sums.T[0] += y * y;
    sums.T[1] += y * Ky;
    for (size_t d = 0; d < n_motion; ++d) {
      read(own + Sample::Q + d * n_lanes, KQ[0][d]);
      read(all + Sample::Q + d * n_lanes, KQ[1][d]);
    }
    for (size_t r = 0; r < n_lanes; ++r) {
      Lanes Pi, K2Pi;
      read(own + Sample::Pi + r * n_lanes, Pi);
      read(all + Sample::Pi + r * n_lanes, K2Pi);
      sums.both[0][r] += Pi * Pi;
      sums.both[1][r] += Pi * K2Pi;
      for (int a = 0; a < 2; ++a) {
        for (int b = a; b < 2; ++b) {
          Lanes product = {};
          for (int d = 0; d < n_motion; ++d) product += KQ[a][d][r] * KQ[b][d];
          sums.one[a][b][r] += Pi * product;
        }
      }
    }
    for (int a = 0; a < 2; ++a) {
      for (int d = 0; d < n_motion; ++d) {
        for (int e = d; e < n_motion; ++e) sums.W[a][d][e] += KQ[0][d] * KQ[a][e];
      }
    }
  }
}

/// Linear equations E[T] = S variances.
struct VarianceEquations {
  PartsVector T = PartsVector::Zero();
  PartsMatrix S = PartsMatrix::Zero();
};

VarianceEquations equations_between(const PairSums& sums) {
  VarianceEquations out;
  for (int a = 0; a < 2; ++a) {
    for (size_t r = 0; r < n_lanes; ++r) {
      out.T[2 * kind_of[r] + a] += sums.T[a][r];
      for (int b = 0; b < 2; ++b) {
        for (size_t c = 0; c < n_lanes; ++c) {
          double fit = 0;
          for (int d = 0; d < n_motion; ++d) {
            for (int e = d; e < n_motion; ++e)
              fit += (d == e ? 1 : 2) * sums.W[a][d][e][r] * sums.W[b][d][e][c];
          }
          const double one = a <= b ? sums.one[a][b][r][c] : sums.one[b][a][c][r];
          out.S(2 * kind_of[r] + a, 2 * kind_of[c] + b) += sums.both[a * b][r][c] - 2 * one + fit;
        }
      }
    }
  }
  return out;
}

/// Fills the sample. Returns false if the points do not determine a motion.
bool take_sample(const std::vector<ErrorScore>& points, Sample& sample) {
  const size_t n = std::min(points.size(), parts_sample);
  const auto point = [&](size_t i) -> const ErrorScore& { return points[i * points.size() / n]; };
  Matrix6d H = Matrix6d::Zero();
  for (size_t i = 0; i < n; ++i) {
    const Lanes* J = point(i).derivative;
    for (int a = 0; a < n_motion; ++a) {
      for (int b = a; b < n_motion; ++b) {
        const Lanes product = J[a] * J[b];
        H(b, a) += sum_of_lanes(&product);
      }
    }
  }
  const Eigen::LLT<Matrix6d> factor(H);
  if (factor.info() != Eigen::Success) return false;
  const Matrix6d to_q = factor.matrixL().solve(Matrix6d::Identity());
  const auto put = [&](const Lanes& from, float* to) {
    for (size_t c = 0; c < n_lanes; ++c) to[c] = static_cast<float>(from[c]);
  };
  sample.n = n;
  for (size_t i = 0; i < n; ++i) {
    const ErrorScore& p = point(i);
    float* const at = sample.values + i * Sample::width;
    sample.u[i] = static_cast<float>(p.u);
    sample.v[i] = static_cast<float>(p.v);
    put(p.residual, at + Sample::y);
    for (size_t r = 0; r < n_lanes; ++r) {
      Lanes Pi = -p.by_depth[r] * p.by_depth;
      Pi[r] += p.measured[r];
      put(Pi, at + Sample::Pi + r * n_lanes);
    }
    for (size_t a = 0; a < n_motion; ++a) {
      Lanes q = {};
      for (size_t b = 0; b <= a; ++b) q += to_q(a, b) * p.derivative[b];
      put(q, at + Sample::Q + a * n_lanes);
    }
  }
  return true;
}

/// Returns the variances x >= 0 that minimise x^T S x / 2 - T^T x, with 0 for those that are not in `among`;
/// by coordinate descent, which converges because S is a Gram matrix.
PartsVector non_negative(const VarianceEquations& equations, const std::array<bool, n_parts>& among) {
  constexpr int max_rounds = 200;
  const PartsMatrix& S = equations.S;
  PartsVector x = PartsVector::Zero();
  for (int round = 0; round < max_rounds; ++round) {
    double change = 0;
    for (int a = 0; a < n_parts; ++a) {
      if (!among[a]) continue;
      const double next = std::max(x[a] + (equations.T[a] - S.row(a).dot(x)) / S(a, a), 0.0);
      change = std::max(change, std::abs(next - x[a]));
      x[a] = next;
    }
    if (!(change > 1e-6 * x.maxCoeff())) break;
  }
  return x;
}

/// Returns the standard deviations of the variances of `among` for independent errors of variance 1.
PartsVector deviations_of(const VarianceEquations& equations, const std::array<bool, n_parts>& among) {
  PartsMatrix S = PartsMatrix::Identity();
  for (int a = 0; a < n_parts; ++a) {
    for (int b = 0; b < n_parts; ++b) {
      if (among[a] && among[b]) S(a, b) = equations.S(a, b);
    }
  }
  return (2 * S.inverse().diagonal()).cwiseMax(0).cwiseSqrt();
}

}  // namespace

bool ErrorParts::correlate() const { return sum_of_lanes(&correlated) > 0; }

void ErrorParts::raise_to(double variance) {
  double shares = 0;
  for (const SpatialCorrelation::Part& part : shape) shares += part.share;
  for (size_t c = 0; c < n_lanes; ++c)
    independent[c] += std::max(variance - independent[c] - shares * correlated[c], 0.0);
}

ErrorParts estimate_error_parts(const std::vector<ErrorScore>& points) {
  constexpr double significant = 2, raised = 2.5, undetermined = 1, fewest_freedoms = 4;
  ErrorParts out;
  Sample sample;
  if (points.size() < 2 * n_motion || !take_sample(points, sample)) return out;
  const std::vector<float>& table = shape_table();
  PairSums sums;
  sum_over_pairs(sample, table.data(), static_cast<float>(table.size() - 1), sums);
  VarianceEquations equations = equations_between(sums);
  std::array<bool, n_parts> among{};
  // restricted to the measured components
  for (int a = 0; a < n_parts; ++a) among[a] = equations.S(a, a) > 1e-9;
  const PartsVector deviations = deviations_of(equations, among);
  for (int a = 0; a < n_parts; a += 2) {
    if (!among[a] || deviations[a] < undetermined) continue;
    equations.T -= equations.S.col(a);
    among[a] = among[a + 1] = false;
  }
  PartsVector x = non_negative(equations, among);
  out.significant = false;
  for (int a = 0; a < n_parts; a += 2) {
    if (!among[a]) continue;
    out.significant |= x[a + 1] > significant * deviations[a + 1] * (x[a] + x[a + 1]);
    const double more = std::min(raised * deviations[a + 1], 1.0) * (x[a] + x[a + 1]);
    x[a] = std::max(x[a] - more, 0.0);
    x[a + 1] += more;
  }
  // tr(K_a R), since R = R R.
  PartsVector traces = PartsVector::Zero();
  for (int kind = 0; kind < n_kinds; ++kind) traces += equations.S.col(2 * kind);
  for (int a = 0; a < n_parts; a += 2) {
    const Eigen::Vector2d own = x.segment<2>(a);
    const double freedoms =
        std::max(std::pow(traces.segment<2>(a).dot(own), 2) / own.dot(equations.S.block<2, 2>(a, a) * own),
                 fewest_freedoms);
    if (own.maxCoeff() > 0) x.segment<2>(a) *= freedoms / (freedoms - 2);
  }
  // Kinds whose variances are not determined get the mean variances of the determined kinds.
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double n_determined = 0;
  for (int a = 0; a < n_parts; a += 2) {
    if (!among[a]) continue;
    mean += x.segment<2>(a);
    n_determined += 1;
  }
  for (size_t c = 0; c < n_lanes && n_determined > 0; ++c) {
    const int a = 2 * kind_of[c];
    const Eigen::Vector2d own = among[a] ? Eigen::Vector2d(x.segment<2>(a)) : mean / n_determined;
    out.independent[c] = own[0];
    out.correlated[c] = own[1];
  }
  out.shape = error_shape;
  return out;
}

ScoreMatrix smooth_error_scores(const std::vector<ErrorScore>& scores, const ErrorParts& parts,
                                const NoiseLevels& levels) {
  ScoreMatrix M = correlated_scores(scores, parts.shape).times(parts.correlated);
  if (parts.persistent == 0 || !(levels.delta_d_curr_px > 0)) return M;
  // One error in px has an effect through the disparities of both frames.
  const double per_curr = levels.delta_d_px / levels.delta_d_curr_px;
  std::vector<ErrorScore> both = scores;
  for (ErrorScore& score : both) {
    for (Lanes& row : score.derivative) row = Lanes{0, 0, row[2] + per_curr * row[3], 0};
  }
  return M + correlated_scores(both, parts.shape).times(Lanes{0, 0, parts.persistent, 0});
}

namespace {

/// Appends scores with their derivatives with respect to the motion multiplied by `to`.
void append(const ErrorModel& from, const Matrix6d& to, std::vector<ErrorScore>& out) {
  for (const ErrorScore& score : from.scores) {
    ErrorScore& changed = out.emplace_back();
    changed.u = score.u;
    changed.v = score.v;
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 6; ++b) changed.derivative[a] += to(a, b) * score.derivative[b];
    }
  }
}

}  // namespace

Matrix6d common_errors(const ErrorModel& first, const ErrorModel& second, const Matrix6d& to) {
  Matrix6d out = Matrix6d::Zero();
  if (first.parts.correlate() && second.parts.correlate()) {
    const auto sum_of = [&](const std::vector<ErrorScore>& scores) -> Matrix6d {
      return smooth_error_scores(scores, first.parts, first.levels).topLeftCorner<6, 6>();
    };
    std::vector<ErrorScore> one, other, both;
    append(first, to * first.to_twist, one);
    append(second, to * second.to_twist, other);
    both = one;
    both.insert(both.end(), other.begin(), other.end());
    out = sum_of(both) - sum_of(one) - sum_of(other);
  }
  const Vector6d a = to * first.to_twist * first.by_offset, b = to * second.to_twist * second.by_offset;
  return out + first.squared_offset_px2 * (a * b.transpose() + b * a.transpose());
}

}  // namespace sextant
