#pragma once

// Four doubles at a time, for the loops over points. With -ffp-contract=off (cmake/SextantOptions.cmake) the
// clones of a SEXTANT_SIMD function for different processors give the same bits.

#include <array>
#include <cstddef>

#include "sextant/geometry/se3.h"

#define SEXTANT_SIMD __attribute__((target_clones("avx2", "default")))
// Macros, not functions: a vector return would change the calling convention between the clones.
#define SEXTANT_LOAD(pointer) (*reinterpret_cast<const ::sextant::UnalignedLanes*>(pointer))
#define SEXTANT_STORE(pointer, value) (*reinterpret_cast<::sextant::UnalignedLanes*>(pointer) = (value))

namespace sextant {

inline constexpr size_t n_lanes = 4;
using Lanes = double __attribute__((vector_size(n_lanes * sizeof(double))));
using UnalignedLanes =
    double __attribute__((vector_size(n_lanes * sizeof(double)), aligned(sizeof(double)), may_alias));
using LaneMask = long __attribute__((vector_size(n_lanes * sizeof(double))));

/// R (row-major) and t as plain numbers.
struct RigidMotion {
  std::array<double, 9> r;
  std::array<double, 3> t;
  explicit RigidMotion(const SE3& T) {
    const Eigen::Matrix3d m = T.rotation().toRotationMatrix();
    for (int i = 0; i < 9; ++i) r[i] = m(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) t[i] = T.translation()[i];
  }
};

/// A point nearer than this to the camera plane counts as behind it (m).
inline constexpr double min_depth_m = 1e-3;

}  // namespace sextant
