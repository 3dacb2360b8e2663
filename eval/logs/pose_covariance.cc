#include "sextant/eval/logs/pose_covariance.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"

namespace sextant {
namespace {

constexpr double largest_asymmetry = 1e-6;  // relative to the square root of the product of the variances
constexpr double least_eigenvalue = -1e-9;  // of the correlation matrix
constexpr double singular = 1e-12;          // eigenvalue of the correlation matrix

/// Copies the upper triangle of an n x n matrix, given row by row, to both triangles from (at, at) on.
void put_triangle(PoseCovariance& P, std::span<const double> numbers, int at, int n) {
  size_t k = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = i; j < n; ++j) P(at + i, at + j) = P(at + j, at + i) = numbers[k++];
  }
}

PoseCovariance matrix_of(std::span<const double> numbers) {
  PoseCovariance P = PoseCovariance::Zero();
  if (numbers.size() == 12) {
    put_triangle(P, numbers.first(6), 0, 3);
    put_triangle(P, numbers.last(6), 3, 3);
  } else if (numbers.size() == 21) {
    put_triangle(P, numbers, 0, 6);
  } else {
    SEXTANT_CHECK(numbers.size() == 36);
    for (int i = 0; i < 36; ++i) P(i / 6, i % 6) = numbers[static_cast<size_t>(i)];
  }
  return P;
}

/// Scales to a unit diagonal, so that metres and radians are comparable; 0 for a variance of 0.
PoseCovariance correlation_of(const PoseCovariance& P) {
  PoseCovariance C = P;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double scale = std::sqrt(std::abs(P(i, i)) * std::abs(P(j, j)));
      C(i, j) = scale > 0 ? P(i, j) / scale : (P(i, j) == 0 ? 0 : P(i, j) / std::abs(P(i, j)));
    }
  }
  return C;
}

double smallest_eigenvalue(const PoseCovariance& C) {
  return Eigen::SelfAdjointEigenSolver<PoseCovariance>(C, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

void check(const PoseCovariance& P, const std::string& path, int64_t number) {
  if (!P.allFinite()) fail("{}:{}: the covariance of the pose is not finite", path, number);
  const PoseCovariance C = correlation_of(P);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) {
      if (std::abs(C(i, j) - C(j, i)) <= largest_asymmetry) continue;
      fail(
          "{}:{}: the covariance of the pose is not symmetric: ({},{}) is {:.6g}, ({},{}) is {:.6g}; "
          "expected a covariance row by row: are blocks transposed, or columns missing?",
          path, number, i + 1, j + 1, P(i, j), j + 1, i + 1, P(j, i));
    }
  }
  const double least = smallest_eigenvalue(C);
  if (least < least_eigenvalue) {
    fail(
        "{}:{}: the covariance of the pose is not positive definite (the correlation matrix has the "
        "eigenvalue {:.3g}): expected the upper triangle or the whole matrix row by row",
        path, number, least);
  }
}

/// Converts a covariance to the axes of the world; see covariance_convention.h.
PoseCovariance in_world(const PoseCovariance& P, const Eigen::Matrix3d& R, CovarianceConvention convention) {
  if (convention == CovarianceConvention::ros) return P;
  PoseCovariance J = PoseCovariance::Zero();
  J.topRightCorner<3, 3>() =
      convention == CovarianceConvention::gtsam ? R : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  J.bottomLeftCorner<3, 3>() = R;
  return J * P * J.transpose();
}

}  // namespace

bool is_covariance_size(size_t n) { return n == 12 || n == 21 || n == 36; }

void add_covariance(PoseSeries& series, std::span<const double> numbers,
                    std::optional<CovarianceConvention> convention, const std::string& path, int64_t number) {
  const PoseCovariance P = matrix_of(numbers);
  check(P, path, number);
  const CovarianceConvention by_size =
      numbers.size() == 12 ? CovarianceConvention::openvins : CovarianceConvention::ros;
  const PoseCovariance S = 0.5 * (P + P.transpose());
  series.covariances.push_back(in_world(S, series.rotations.back(), convention.value_or(by_size)));
}

void finish_covariances(PoseSeries& series, const std::string& path, RepairLog& log) {
  std::vector<PoseCovariance>& all = series.covariances;
  if (all.empty()) return;
  if (all.size() != series.size())
    fail("{}: {} of {} poses have covariances: expected one with each", path, all.size(), series.size());
  const auto number = [&](size_t i) {
    return series.lines.empty() ? static_cast<int>(i) + 1 : series.lines[i];
  };
  std::optional<size_t> unknown;
  size_t n_unknown = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    if (!all[i].isZero(0)) continue;
    if (n_unknown++ == 0) unknown = i;
  }
  if (unknown && n_unknown < all.size())
    fail("{}:{}: the covariance of the pose is all zeros, but others are not: expected one with each pose",
         path, number(*unknown));
  if (unknown) return all.clear();
  for (size_t i = 0; i < all.size(); ++i) {
    if (smallest_eigenvalue(correlation_of(all[i])) > singular) continue;
    log.note("covariances that are singular, of a pose with a direction that is exactly known: no NEES",
             number(i));
    return all.clear();
  }
}

}  // namespace sextant
