#include "sextant/estimator/consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

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
  const auto middle = columns.begin() + static_cast<std::ptrdiff_t>(columns.size() / 2);
  std::nth_element(columns.begin(), middle, columns.end());
  const auto odd = [](double pixel) { return std::fmod(std::floor(pixel / cell_px), 2) != 0; };
  return {nees_of(problem, whole, estimator, [&](size_t i) { return p.u[i] < *middle; }),
          nees_of(problem, whole, estimator, [&](size_t i) { return odd(p.u[i]) == odd(p.v[i]); })};
}

}  // namespace sextant
