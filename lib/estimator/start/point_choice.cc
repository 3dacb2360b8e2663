#include "sextant/estimator/start/point_choice.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/quantile.h"
#include "sextant/estimator/solvers/reprojection_solver.h"
#include "sextant/geometry/lanes.h"

namespace sextant {
namespace {

constexpr int rounds = 2;              // alternations of fit and motion
constexpr int fit_steps = 6;           // steps of expectation maximisation per round
constexpr size_t sample_size = 1000;   // up to twice as many residuals determine the scales to 3 %
constexpr float window = 4;            // in standard deviations
constexpr double min_sigma_px = 0.01;  // stored measurements are quantised; no smaller sigma is meaningful
constexpr double huber = 1.345;        // kernel of the motion between fits, in standard deviations
constexpr double distinct = 3;  // ratio of inliers to expected inliers above which they form a distinct class
constexpr size_t min_points = 4;

using Errors = std::vector<float>;  ///< padded to whole lanes
using L = LanesOf<float>;

/// Computes exp(x) to 1e-4 for x in [-80, 0].
SEXTANT_INLINED void exponential(L& x) {
  const L log2 = x * 1.44269504F;
  const auto whole = __builtin_convertvector(log2 - 1.0F, LaneMaskOf<float>);  // towards zero: the next below
  const L f = log2 - __builtin_convertvector(whole, L);
  const L power = 1.0F + f * (0.693147F + f * (0.240227F + f * (0.0555041F + f * 0.0096181F)));
  x = power * reinterpret_cast<L>((whole + 127) << 23);
}

struct MixtureSums {
  double uu = 0, vv = 0, core = 0, n = 0;
};

/// Sums over the points in the window, weighted by their probability to belong to the core. Densities are
/// relative to 1 / (pi sigma_u sigma_v).
SEXTANT_SIMD MixtureSums sum_mixture(const Errors& eu, const Errors& ev, float per_sigma_u, float per_sigma_v,
                                     float core_share) {
  constexpr float window2 = window * window;
  const float wrong = (1 - core_share) / window2;
  const L zero = {};
  L uu = {}, vv = {}, core = {}, n = {};
  for (size_t k = 0; k < eu.size(); k += LaneTypes<float>::n) {
    const L u = SEXTANT_LOAD(eu.data() + k);
    const L v = SEXTANT_LOAD(ev.data() + k);
    const L a = u * per_sigma_u;
    const L b = v * per_sigma_v;
    const L q = a * a + b * b;
    const auto inside = q <= window2;
    L good = -0.5F * (inside ? q : zero);
    exponential(good);
    good *= 0.5F * core_share;
    const L weight = inside ? good / (good + wrong) : zero;
    uu += inside ? weight * u * u : zero;
    vv += inside ? weight * v * v : zero;
    core += weight;
    n += inside ? zero + 1.0F : zero;
  }
  return {sum_of_lanes(&uu), sum_of_lanes(&vv), sum_of_lanes(&core), sum_of_lanes(&n)};
}

/// Mixture model of residuals: a Gaussian core and uniformly distributed outliers.
struct ResidualMixture {
  double sigma_u_px = 0;
  double sigma_v_px = 0;
  double core_share = 0.9;
  bool ok = false;  ///< the window contains enough points

  /// Initial scales: those of the inliers. But if the inliers are no more than expected from a Gaussian with
  /// the scale of all residuals, the threshold has merely truncated that Gaussian, and the scales of all
  /// residuals are used.
  ResidualMixture(const Errors& eu, const Errors& ev, const std::vector<uint32_t>& inliers, size_t n_points) {
    double uu = 0, vv = 0, n = 0, farthest2 = 0;
    for (const uint32_t k : inliers) {
      if (!std::isfinite(eu[k])) continue;
      const double u2 = eu[k] * eu[k], v2 = ev[k] * ev[k];
      uu += u2;
      vv += v2;
      ++n;
      farthest2 = std::max(farthest2, u2 + v2);
    }
    ok = n >= min_points;
    if (!ok) return;
    take_scales(uu / n, vv / n);
    const double wide_u = gaussian_scale(eu, n_points);
    const double wide_v = gaussian_scale(ev, n_points);
    const double expected = static_cast<double>(n_points) * -std::expm1(-0.5 * farthest2 / (wide_u * wide_v));
    if (n <= distinct * expected) take_scales(wide_u * wide_u, wide_v * wide_v);
  }

  /// Fits the mixture by expectation maximisation.
  void fit(const Errors& eu, const Errors& ev) {
    for (int step = 0; step < fit_steps && ok; ++step) {
      const MixtureSums sums =
          sum_mixture(eu, ev, static_cast<float>(1 / sigma_u_px), static_cast<float>(1 / sigma_v_px),
                      static_cast<float>(core_share));
      ok = sums.core >= min_points;
      if (!ok) return;
      take_scales(sums.uu / sums.core, sums.vv / sums.core);
      core_share = std::min(sums.core / sums.n, 1 - 1 / (sums.n + 1));  // assumes at least one more outlier
    }
  }

  /// Calls take(k, belongs) for each point k, where `belongs` is true if the core is the more likely
  /// component.
  void choose(const Errors& eu, const Errors& ev, size_t n, const auto& take) const {
    const double odds = 0.5 * core_share * window * window / (1 - core_share);
    const auto gate2 = static_cast<float>(std::clamp(2 * std::log(odds), 0.0, double{window} * window));
    const auto per_u = static_cast<float>(1 / sigma_u_px), per_v = static_cast<float>(1 / sigma_v_px);
    for (size_t k = 0; k < n; ++k) {
      const float a = eu[k] * per_u, b = ev[k] * per_v;
      take(k, a * a + b * b <= gate2);
    }
  }

 private:
  /// Robust scale from the median of absolute values, of a subset of the first `n`.
  static double gaussian_scale(const Errors& errors, size_t n) {
    constexpr double normal_mad = 1.4826;
    constexpr size_t enough = 250;  // up to twice as many values are used
    Errors absolute;
    for (size_t k = 0; k < n; k += std::max<size_t>(n / enough, 1)) absolute.push_back(std::abs(errors[k]));
    return std::max(normal_mad * middle_of(absolute), min_sigma_px);
  }

  void take_scales(double variance_u, double variance_v) {
    sigma_u_px = std::max(std::sqrt(variance_u), min_sigma_px);
    sigma_v_px = std::max(std::sqrt(variance_v), min_sigma_px);
  }
};

std::vector<uint32_t> every(const std::vector<uint32_t>& indices, size_t size) {
  const size_t step = std::max<size_t>(indices.size() / size, 1);
  std::vector<uint32_t> some;
  for (size_t k = 0; k < indices.size(); k += step) some.push_back(indices[k]);
  return some;
}

/// Alternates fit and motion. `all`: all of these points; `sample`: a subset, for the fit and the motion.
StartingPoint reselected(const RoughReprojectionData& all, RoughReprojectionData sample,
                         const std::vector<uint32_t>& points, const StartingPoint& start) {
  Errors eu, ev;
  reprojection_errors(all, start.T_curr_prev, eu, ev);
  std::vector<uint32_t> inliers;
  for (uint32_t k = 0; k < points.size(); ++k) {
    if (start.inliers[points[k]] != 0) inliers.push_back(k);
  }
  ResidualMixture mixture(eu, ev, inliers, points.size());
  SE3 motion = start.T_curr_prev;
  for (int round = 0; round < rounds && mixture.ok; ++round) {
    reprojection_errors(sample, motion, eu, ev);
    mixture.fit(eu, ev);
    mixture.choose(eu, ev, sample.size(), [&](size_t k, bool counts) { sample.use(k, counts); });
    const double sigma = std::hypot(mixture.sigma_u_px, mixture.sigma_v_px) / std::sqrt(2.0);
    const SolverResult result =
        minimize_reprojection(sample, motion, {sigma, huber}, {.max_iterations = 5, .step_tolerance = 1e-5});
    if (!result.T_curr_prev.is_finite() || !std::isfinite(result.at_optimum.cost)) return start;
    motion = result.T_curr_prev;
  }
  if (!mixture.ok) return start;
  reprojection_errors(all, motion, eu, ev);
  StartingPoint out{motion, std::vector<unsigned char>(start.inliers.size(), 0)};
  mixture.choose(eu, ev, points.size(),
                 [&](size_t k, bool counts) { out.inliers[points[k]] = counts ? 1 : 0; });
  return out;
}

}  // namespace

StartingPoint choose_points(const Problem& problem, const StartingPoint& start, RefineOn refine_on) {
  if (refine_on == RefineOn::inliers) return start;
  std::vector<uint32_t> points;
  for (uint32_t i = 0; i < problem.points.size(); ++i) {
    if (problem.points.is_measurement(i)) points.push_back(i);
  }
  const RoughReprojectionData all(problem, points);
  if (refine_on == RefineOn::reselected)
    return reselected(all, {problem, every(points, sample_size)}, points, start);
  StartingPoint out{start.T_curr_prev, std::vector<unsigned char>(start.inliers.size(), 0)};
  Errors eu, ev;
  reprojection_errors(all, start.T_curr_prev, eu, ev);
  for (size_t k = 0; k < points.size(); ++k) out.inliers[points[k]] = std::isfinite(eu[k]) ? 1 : 0;
  return out;
}

}  // namespace sextant
