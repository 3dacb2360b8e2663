#include "sextant/estimator/consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "sextant/base/quantile.h"
#include "sextant/estimator/flow_depth/error_model.h"

namespace sextant {
namespace {

constexpr double cell_px = 80;

MotionEstimate estimate_some(const Problem& problem, const MotionEstimate& whole,
                             const std::vector<unsigned char>& keep, const Estimator& estimator) {
  const auto n = static_cast<size_t>(std::count(keep.begin(), keep.end(), 1));
  const StartingPoint start{whole.T_curr_prev, std::vector<unsigned char>(n, 1), whole.errors};
  return estimator.estimate({problem.camera, problem.points.subset(keep), problem.noise}, start);
}

template <typename InFirst>
std::optional<double> nees_of(const Problem& problem, const MotionEstimate& whole, const Estimator& estimator,
                              InFirst&& in_first) {
  std::vector<unsigned char> first(problem.points.size()), second(problem.points.size());
  for (size_t i = 0; i < first.size(); ++i) {
    if (whole.inliers[i] != 0) (in_first(i) ? first : second)[i] = 1;
  }
  const MotionEstimate a = estimate_some(problem, whole, first, estimator);
  const MotionEstimate b = estimate_some(problem, whole, second, estimator);
  if (a.status != Status::ok || b.status != Status::ok) return std::nullopt;
  const Eigen::LLT<Matrix6d> factor(a.covariance + b.covariance);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Vector6d e = (a.T_curr_prev * b.T_curr_prev.inverse()).log();
  // Whitening: coordinates in which C_1 + C_2 is the identity.
  const Matrix6d to = factor.matrixL().solve(Matrix6d::Identity());
  Matrix6d covariance = Matrix6d::Identity();
  if (a.errors && b.errors) covariance -= common_errors(*a.errors, *b.errors, to);
  const Eigen::LLT<Matrix6d> of_difference(covariance);
  if (of_difference.info() != Eigen::Success) return std::nullopt;
  const double nees = of_difference.matrixL().solve(to * e).squaredNorm();
  return std::isfinite(nees) ? std::optional(nees) : std::nullopt;
}

}  // namespace

SplitNees split_nees(const Problem& problem, const MotionEstimate& whole, const Estimator& estimator) {
  const Correspondences& p = problem.points;
  std::vector<double> columns;
  for (size_t i = 0; i < p.size(); ++i) {
    if (whole.inliers[i] != 0) columns.push_back(p.u[i]);
  }
  if (columns.empty()) return {};
  const double middle = upper_median(columns);
  const auto odd = [](double pixel) { return std::fmod(std::floor(pixel / cell_px), 2) != 0; };
  return {nees_of(problem, whole, estimator, [&](size_t i) { return p.u[i] < middle; }),
          nees_of(problem, whole, estimator, [&](size_t i) { return odd(p.u[i]) == odd(p.v[i]); })};
}

std::optional<ExpansionGap> expansion_gap(const Problem& problem, const MotionEstimate& whole,
                                          const Estimator& estimator) {
  constexpr size_t fewest = 10;
  std::vector<unsigned char> keep(problem.points.size());
  for (size_t i = 0; i < keep.size(); ++i)
    keep[i] = whole.inliers[i] != 0 && problem.points.depth_curr[i] > 0 ? 1 : 0;
  const Correspondences p = problem.points.subset(keep);
  if (p.size() < fewest) return std::nullopt;
  Problem by_flow = problem;
  by_flow.points.depth_curr.assign(problem.points.size(), NAN);
  const MotionEstimate flow = estimate_some(by_flow, whole, keep, estimator);
  if (flow.status != Status::ok) return std::nullopt;

  std::vector<double> ratios, depths_m;
  Eigen::Vector3d centroid_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d sum_px = Eigen::Vector2d::Zero();
  double squares_px = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    const Eigen::Vector3d moved_m =
        flow.T_curr_prev * problem.camera.left.backproject(p.u[i], p.v[i], p.depth[i]);
    const Eigen::Vector2d pixel(p.u[i], p.v[i]);
    centroid_m += moved_m / static_cast<double>(p.size());
    sum_px += pixel;
    squares_px += pixel.squaredNorm();
    depths_m.push_back(moved_m.z());
    ratios.push_back(moved_m.z() / p.depth_curr[i]);
  }
  const auto n = static_cast<double>(p.size());
  const double variance_px = squares_px / n - (sum_px / n).squaredNorm();
  const double depth_m = upper_median(depths_m), y = upper_median(ratios) - 1;
  Vector6d gradient = Vector6d::Zero();
  gradient << 0, 0, 1, centroid_m.y(), -centroid_m.x(), 0;
  gradient /= centroid_m.z();
  const double variance = gradient.dot(flow.covariance * gradient) +
                          common_flow_px * common_flow_px / variance_px +
                          std::pow(common_disparity_px * depth_m / problem.camera.bf, 2);
  const ExpansionGap gap{-y * depth_m, y * y / variance};
  return std::isfinite(gap.chi2) && std::isfinite(gap.gap_m) ? std::optional(gap) : std::nullopt;
}

}  // namespace sextant
