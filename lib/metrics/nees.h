#pragma once

// Normalised estimation error squared (Bar-Shalom, Li, Kirubarajan 2001, sec. 5.4) of a motion:
//
//   NEES = e^T C^-1 e,   exp(e) = Xhat X^-1,   C = covariance of the left twist
//
// If the errors are Gaussian and C is right it is chi-square distributed with 6 degrees of freedom. To first
// order it is the same in every frame: e and C are transported together.

#include <optional>

#include "sextant/geometry/se3.h"

namespace sextant {

inline constexpr int nees_dof = 6;

/// None where the covariance is not positive definite.
std::optional<double> nees(const SE3& estimate, const Matrix6d& covariance, const SE3& truth);

}  // namespace sextant
