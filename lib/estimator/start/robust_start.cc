#include "sextant/estimator/start/robust_start.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "sextant/base/quantile.h"
#include "sextant/estimator/solvers/degeneracy.h"
#include "sextant/estimator/solvers/reprojection_solver.h"
#include "sextant/geometry/lanes.h"

namespace sextant {
namespace {

/// Returns the largest real root m >= 0 of 8 m^3 + 8 p m^2 + (2 p^2 - 8 r) m - q^2.
double resolvent_root(double p, double q, double r) {
  // m^3 + b m^2 + c m + d, depressed to w^3 + e w + f.
  const double b = p;
  const double c = 0.25 * p * p - r;
  const double d = -0.125 * q * q;
  const double e = c - b * b / 3;
  const double f = 2 * b * b * b / 27 - b * c / 3 + d;
  const double discriminant = 0.25 * f * f + e * e * e / 27;
  double w = 0;
  if (discriminant > 0) {
    const double u = std::cbrt(std::abs(0.5 * f) + std::sqrt(discriminant)) * (f > 0 ? -1 : 1);
    w = u - (u == 0 ? 0 : e / (3 * u));
  } else {
    const double radius = std::sqrt(std::max(-e / 3, 0.0));
    const double cosine = radius > 0 ? std::clamp(-0.5 * f / (radius * radius * radius), -1.0, 1.0) : 0;
    w = 2 * radius * std::cos(std::acos(cosine) / 3);
  }
  return std::max(w - b / 3, 0.0);
}

}  // namespace

std::array<double, 4> quartic_roots(const std::array<double, 4>& a) {
  // x = y - a0 / 4: y^4 + p y^2 + q y + r = (y^2 + p / 2 + m)^2 - 2 m (y - q / (4 m))^2.
  const double shift = 0.25 * a[0];
  const double s2 = shift * shift;
  const double p = a[1] - 6 * s2;
  const double q = a[2] - 2 * a[1] * shift + 8 * s2 * shift;
  const double r = a[3] - a[2] * shift + a[1] * s2 - 3 * s2 * s2;
  const double m = resolvent_root(p, q, r);
  const double g = std::sqrt(2 * m);
  // If m is 0 so is q, and the quartic is biquadratic.
  const double h = g > 0 ? q / (2 * g) : std::sqrt(std::max(0.25 * p * p - r, 0.0));
  std::array<double, 4> roots;
  for (const int sign : {-1, 1}) {
    // y^2 + sign g y + p / 2 + m - sign h = 0
    const double quarter = 0.25 * g * g - (0.5 * p + m - sign * h);
    const double root = std::sqrt(std::max(quarter, 0.0));
    roots[1 + sign] = -0.5 * sign * g - shift + root;
    roots[2 + sign] = -0.5 * sign * g - shift - root;
  }
  for (double& x : roots) {
    for (int step = 0; step < 2; ++step) {
      const double value = (((x + a[0]) * x + a[1]) * x + a[2]) * x + a[3];
      const double slope = ((4 * x + 3 * a[0]) * x + 2 * a[1]) * x + a[2];
      const double next = x - value / slope;
      if (std::isfinite(next) && std::abs(next - x) < 0.1) x = next;
    }
  }
  return roots;
}

P3PSolutions::P3PSolutions(const std::array<Eigen::Vector3d, 3>& points,
                           const std::array<Eigen::Vector3d, 3>& rays) {
  using Eigen::Vector3d;
  const Vector3d& b1 = rays[0];
  const Vector3d& b2 = rays[1];
  const Vector3d& b3 = rays[2];
  // Coordinate frames of the first edge and of the plane of the first two rays.
  const Vector3d edge = points[0] - points[1];
  const double length = edge.norm();
  const Vector3d k1 = edge / length;
  const Vector3d normal = b1.cross(b2);
  const double sine = normal.norm();
  const Vector3d k3 = normal / sine;
  const Vector3d tz = b1.cross(k3);
  const Vector3d u1 = points[0] - points[2];
  const Vector3d across = u1.cross(k1);
  const double delta = across.norm();
  const Vector3d nl = across / delta;
  const double k3b3 = k3.dot(b3);

  const Vector3d v1 = b1.cross(b3);
  const Vector3d v2 = b2.cross(b3);
  const double along1 = u1.dot(k1);
  const double along2 = along1 - length;
  const double f11 = delta * k3b3;
  const double f13 = delta * k3.dot(v1);
  const double f15 = -along1 * k3b3;
  const double f21 = delta * tz.dot(v2);
  const double f22 = delta * sine * k3b3;
  const double f23 = delta * k3.dot(v2);
  const double f24 = along2 * sine * k3b3;
  const double f25 = -along2 * tz.dot(v2);
  const double g1 = f13 * f22;
  const double g2 = f13 * f25 - f15 * f23;
  const double g3 = f11 * f23 - f13 * f21;
  const double g4 = -f13 * f24;
  const double g5 = f11 * f22;
  const double g6 = f11 * f25 - f15 * f21;
  const double g7 = -f15 * f24;
  const double lead = g5 * g5 + g1 * g1 + g3 * g3;
  const std::array<double, 4> coefficients = {
      2 * (g5 * g6 + g1 * g2 + g3 * g4) / lead,
      (g6 * g6 + 2 * g5 * g7 + g2 * g2 + g4 * g4 - g1 * g1 - g3 * g3) / lead,
      2 * (g6 * g7 - g1 * g2 - g3 * g4) / lead, (g7 * g7 - g2 * g2 - g4 * g4) / lead};
  for (const double coefficient : coefficients) {
    if (!std::isfinite(coefficient)) return;
  }

  Eigen::Matrix3d from_edge;
  from_edge << k1, nl, k1.cross(nl);
  Eigen::Matrix3d from_rays;
  from_rays << b1, k3, tz;
  for (const double cos1 : quartic_roots(coefficients)) {
    if (!(std::abs(cos1) <= 1)) continue;
    const double sin1 = std::copysign(std::sqrt(1 - cos1 * cos1), k3b3);
    const double scale = sin1 / ((g5 * cos1 + g6) * cos1 + g7);
    const double cos3 = scale * (g1 * cos1 + g2);
    const double sin3 = scale * (g3 * cos1 + g4);
    Eigen::Matrix3d turn;
    turn << cos3, 0, -sin3, sin1 * sin3, cos1, sin1 * cos3, cos1 * sin3, -sin1, cos1 * cos3;
    const Eigen::Matrix3d R = (from_edge * turn * from_rays.transpose()).transpose();
    const Vector3d t = (delta / k3b3 * sin1) * b3 - R * points[2];
    if (!R.allFinite() || !t.allFinite()) continue;
    motions_[size_++] = SE3(Eigen::Quaterniond(R), t);
  }
}

namespace {

/// Returns the number that SplitMix64 (Steele, Lea & Flood 2014) generates from this counter.
uint64_t mix(uint64_t counter) {
  uint64_t z = counter + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// Returns three distinct indices below n, as a function of (n, sample) only.
std::array<size_t, 3> draw_sample(size_t n, int sample) {
  std::array<size_t, 3> indices{};
  uint64_t counter = mix(n) ^ (static_cast<uint64_t>(sample) << 32U);
  for (size_t k = 0; k < 3;) {
    indices[k] = mix(counter++) % n;
    if (std::find(indices.begin(), indices.begin() + k, indices[k]) == indices.begin() + k) ++k;
  }
  return indices;
}

/// Returns the number of samples that contain at least one without outliers at the given confidence.
int iterations_needed(double inlier_share, double confidence) {
  const double good = std::pow(inlier_share, 3);
  if (good >= 1.0 - 1e-12) return 1;
  if (good < 1e-9) return std::numeric_limits<int>::max();
  const double n = std::log(1 - confidence) / std::log(1 - good);
  return n < 1e9 ? static_cast<int>(std::ceil(n)) : std::numeric_limits<int>::max();
}

/// Returns a fixed random permutation, so that any prefix is a random sample.
std::vector<uint32_t> shuffled_indices(size_t n) {
  std::vector<uint32_t> order(n);
  std::iota(order.begin(), order.end(), uint32_t{0});
  for (size_t i = n; i > 1; --i) std::swap(order[i - 1], order[mix(i) % i]);
  return order;
}

/// Returns the motions that map the three points of the sample onto the rays through their targets.
P3PSolutions solve_sample(const RoughReprojectionData& data, const std::array<size_t, 3>& sample) {
  using Data = RoughReprojectionData;
  std::array<Eigen::Vector3d, 3> points;
  std::array<Eigen::Vector3d, 3> rays;
  for (size_t k = 0; k < 3; ++k) {
    const size_t i = sample[k];
    points[k] = {data.column(Data::x)[i], data.column(Data::y)[i], data.column(Data::z)[i]};
    rays[k] = data.camera().ray(data.column(Data::target_u)[i], data.column(Data::target_v)[i]).normalized();
  }
  return {points, rays};
}

}  // namespace

void RobustStartOptions::check() const {
  check_option(inlier_threshold_px > 0, "inlier_threshold_px", inlier_threshold_px, "> 0");
  check_option(confidence > 0 && confidence < 1, "confidence", confidence, "in (0, 1)");
  check_option(max_iterations > 0, "max_iterations", max_iterations, "> 0");
  check_option(min_iterations >= 0 && min_iterations <= max_iterations, "min_iterations", min_iterations,
               "in 0..max_iterations");
  check_option(local_refinements >= 0, "local_refinements", local_refinements, ">= 0");
}

RobustStart robust_start(const Problem& problem, const std::optional<SE3>& propagated,
                         const RobustStartOptions& options) {
  RobustStart result;
  result.status = check_geometry(problem, {});
  if (result.status != Status::ok) return result;
  result.status = Status::too_few_points;
  if (problem.points.size() < 4) return result;
  const std::vector<uint32_t> order = shuffled_indices(problem.points.size());
  RoughReprojectionData data(problem, order);  // in single precision
  const double threshold = options.inlier_threshold_px;
  const auto n = static_cast<double>(data.size());

  SE3 best;
  int best_inliers = 0;
  const auto consider = [&](const SE3& motion) {
    const int inliers = count_inliers(data, motion, threshold, best_inliers + 1);
    if (inliers <= best_inliers) return false;
    best = motion;
    best_inliers = inliers;
    return true;
  };

  if (propagated) result.propagated = consider(*propagated);
  int needed = options.max_iterations;
  while (result.iterations < std::max(needed, options.min_iterations) &&
         result.iterations < options.max_iterations) {
    for (const SE3& motion : solve_sample(data, draw_sample(data.size(), result.iterations))) {
      if (consider(motion)) result.propagated = false;
    }
    ++result.iterations;
    needed = iterations_needed(best_inliers / n, options.confidence);
  }

  std::vector<float> eu, ev;
  const auto is_inlier = [&](size_t k) { return eu[k] * eu[k] + ev[k] * ev[k] <= threshold * threshold; };
  // Locally optimised RANSAC (Chum, Matas & Kittler 2003): refits on all inliers. A refit replaces the motion
  // if it has more inliers. If all points are inliers of both, it replaces it too, because it is more
  // accurate than a motion through three points.
  for (int k = 0; k < options.local_refinements && best_inliers >= 4; ++k) {
    reprojection_errors(data, best, eu, ev);
    for (size_t i = 0; i < data.size(); ++i) data.use(i, is_inlier(i));
    const SolverResult refit =
        minimize_reprojection(data, best, HuberKernel{}, {.max_iterations = 5, .step_tolerance = 1e-5});
    if (!refit.T_curr_prev.is_finite()) break;
    const int inliers = count_inliers(data, refit.T_curr_prev, threshold, best_inliers);
    if (inliers < best_inliers) break;
    const bool has_more = inliers > best_inliers;
    if (!has_more && best_inliers < static_cast<int>(data.size())) break;
    best = refit.T_curr_prev;
    best_inliers = inliers;
    if (!has_more) break;
  }

  result.n_inliers = best_inliers;
  if (best_inliers < 4) return result;
  result.point = {best, std::vector<unsigned char>(problem.points.size())};
  reprojection_errors(data, best, eu, ev);
  for (size_t k = 0; k < order.size(); ++k) result.point.inliers[order[k]] = is_inlier(k) ? 1 : 0;
  result.status = check_geometry(problem, result.point.inliers);
  return result;
}

// ---- Choice of the points that a refinement uses
//
// `reselected` (the default) models the errors e = project(X m) - p - phi within a window of w standard
// deviations as a mixture of a Gaussian core and outliers that are uniform over the window (Torr & Zisserman,
// MLESAC, CVIU 2000; fitted by expectation maximisation),
//
//   p(e) = share N(e; 0, diag(sigma_u^2, sigma_v^2)) + (1 - share) / (pi w^2 sigma_u sigma_v),
//
// and keeps the points that more likely belong to the core. If there are no outliers the gate opens to w
// standard deviations; if two thirds of the points belong to the core, it closes to 2.3, and if half do, to
// 2.0. Fit and motion alternate.

namespace {

constexpr int rounds = 2;             // alternations of fit and motion
constexpr int fit_steps = 6;          // steps of expectation maximisation per round
constexpr size_t sample_size = 1000;  // up to twice as many residuals determine the scales to 3 %
constexpr float window = 4;           // in standard deviations
// No optical flow is more precise than this. Where flow is exact, residuals come from the depths and increase
// with the flow of a point: a gate of that scale would keep the points that determine the motion worst.
constexpr double min_sigma_px = 0.05;
constexpr double huber = 1.345;  // kernel of the motion between fits, in standard deviations
constexpr double distinct = 3;  // ratio of inliers to expected inliers above which they form a distinct class
constexpr size_t min_points = 4;

using Errors = std::vector<float>;  ///< padded to whole lanes
using L = LanesOf<float>;

/// Computes exp(x) to 1e-4 for x in [-80, 0].
SEXTANT_INLINED void exponential(L& x) {
  const L log2 = x * 1.44269504F;
  // The conversion truncates towards zero; because x <= 0, this is the largest integer below log2.
  const auto whole = __builtin_convertvector(log2 - 1.0F, LaneMaskOf<float>);
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
    return std::max(normal_mad * upper_median(absolute), min_sigma_px);
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
