#include "sextant/estimator/start/robust_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "sextant/estimator/solvers/degeneracy.h"
#include "sextant/estimator/solvers/reprojection_solver.h"
#include "sextant/estimator/start/p3p.h"

namespace sextant {
namespace {

/// SplitMix64 (Steele, Lea & Flood 2014) of a counter: the same sample for the same index, always.
uint64_t mix(uint64_t counter) {
  uint64_t z = counter + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// Three distinct indices below n, a function of (n, sample) only.
std::array<size_t, 3> draw_sample(size_t n, int sample) {
  std::array<size_t, 3> indices{};
  uint64_t counter = mix(n) ^ (static_cast<uint64_t>(sample) << 32U);
  for (size_t k = 0; k < 3;) {
    indices[k] = mix(counter++) % n;
    if (std::find(indices.begin(), indices.begin() + k, indices[k]) == indices.begin() + k) ++k;
  }
  return indices;
}

/// Samples needed to draw one without outliers with the given confidence.
int iterations_needed(double inlier_share, double confidence) {
  const double good = std::pow(inlier_share, 3);
  if (good >= 1.0 - 1e-12) return 1;
  if (good < 1e-9) return std::numeric_limits<int>::max();
  const double n = std::log(1 - confidence) / std::log(1 - good);
  return n < 1e9 ? static_cast<int>(std::ceil(n)) : std::numeric_limits<int>::max();
}

/// A fixed random order, so that any prefix is a fair sample.
std::vector<uint32_t> shuffled_indices(size_t n) {
  std::vector<uint32_t> order(n);
  std::iota(order.begin(), order.end(), uint32_t{0});
  for (size_t i = n; i > 1; --i) std::swap(order[i - 1], order[mix(i) % i]);
  return order;
}

/// The motions through three correspondences.
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
  RoughReprojectionData data(problem, order);
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

  std::vector<float> errors;
  const auto is_inlier = [&](size_t k) { return errors[k] <= threshold * threshold; };
  // Locally optimised RANSAC (Chum, Matas & Kittler 2003): refit on all inliers, keep what gains inliers.
  for (int k = 0; k < options.local_refinements && best_inliers >= 4; ++k) {
    squared_errors(data, best, errors);
    for (size_t i = 0; i < data.size(); ++i) data.use(i, is_inlier(i));
    const SolverResult refit =
        minimize_reprojection(data, best, HuberKernel{}, {.max_iterations = 5, .step_tolerance = 1e-5});
    if (!refit.T_curr_prev.is_finite() || !consider(refit.T_curr_prev)) break;
  }

  result.n_inliers = best_inliers;
  if (best_inliers < 4) return result;
  result.start = {best, std::vector<unsigned char>(problem.points.size())};
  squared_errors(data, best, errors);
  for (size_t k = 0; k < order.size(); ++k) result.start.inliers[order[k]] = is_inlier(k) ? 1 : 0;
  result.status = check_geometry(problem, result.start.inliers);
  return result;
}

}  // namespace sextant
