#pragma once

// Matchers and helpers for tests of geometry:
//
//   EXPECT_THAT(T, SE3Near(expected, 1e-12));        angle (rad) and distance (m) of expected^-1 * T
//   EXPECT_THAT(matrix, EigenNear(expected, 1e-9));  largest absolute difference
//   EXPECT_THAT(J, EigenNear(numeric_jacobian(f, x), 1e-6));

#include <gmock/gmock.h>

#include <Eigen/Core>
#include <algorithm>
#include <random>
#include <type_traits>

#include "sextant/geometry/se3.h"

namespace sextant {

MATCHER_P2(EigenNear, expected, tolerance, "is near the expected matrix") {
  if (arg.rows() != expected.rows() || arg.cols() != expected.cols()) {
    *result_listener << "size " << arg.rows() << "x" << arg.cols();
    return false;
  }
  const double difference = (arg - expected).cwiseAbs().maxCoeff();
  *result_listener << "largest difference " << difference << "; expected\n" << expected;
  return difference <= tolerance;  // false for NaN
}

MATCHER_P2(SE3Near, expected, tolerance, "is near the expected motion") {
  const SE3 difference = expected.inverse() * arg;
  const double angle = rotation_angle_rad(difference.rotation());
  const double distance = difference.translation().norm();
  *result_listener << "differs by " << angle << " rad and " << distance << " m";
  return angle <= tolerance && distance <= tolerance;
}

/// Returns the Jacobian of a vector function by central differences, with a step relative to the size of each
/// coordinate.
template <typename Function, int N>
auto numeric_jacobian(const Function& f, const Eigen::Matrix<double, N, 1>& x, double step = 1e-6) {
  using Value = std::remove_cvref_t<decltype(f(x).eval())>;
  Eigen::Matrix<double, Value::RowsAtCompileTime, N> jacobian;
  for (int i = 0; i < N; ++i) {
    const double h = step * std::max(1.0, std::abs(x[i]));
    Eigen::Matrix<double, N, 1> above = x;
    Eigen::Matrix<double, N, 1> below = x;
    above[i] += h;
    below[i] -= h;
    jacobian.col(i) = (f(above) - f(below)) / (above[i] - below[i]);
  }
  return jacobian;
}

/// Returns a random twist [m; rad] with translation entries uniform in [-scale_m, scale_m] and rotation
/// entries in [-scale_rad, scale_rad].
inline Vector6d random_twist(std::mt19937_64& generator, double scale_m, double scale_rad) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = uniform(generator) * (i < 3 ? scale_m : scale_rad);
  return xi;
}

}  // namespace sextant
