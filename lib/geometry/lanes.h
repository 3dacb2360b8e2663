#pragma once

// 32 bytes at a time, four doubles or eight floats, for the loops over points (base/simd.h).

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "sextant/base/simd.h"
#include "sextant/geometry/se3.h"

// Macros, not functions: a vector return would change the calling convention between the clones.
#define SEXTANT_LOAD(pointer) \
  (*reinterpret_cast<const ::sextant::UnalignedLanesOf<std::remove_cvref_t<decltype(*(pointer))>>*>(pointer))
#define SEXTANT_STORE(pointer, value)                                                                    \
  (*reinterpret_cast<::sextant::UnalignedLanesOf<std::remove_cvref_t<decltype(*(pointer))>>*>(pointer) = \
       (value))

namespace sextant {

/// Where lanes are passed in memory to a SEXTANT_SIMD function, what holds them is alignas(lane_bytes): its
/// clone for AVX takes that for granted, what calls it does not.
inline constexpr size_t lane_bytes = 32;

/// Relative, of a sum of thousands of numbers >= 0.
template <typename Real>
inline constexpr double rounding_of_sums = sizeof(Real) == 4 ? 1e-6 : 1e-12;

// GCC ignores vector_size on a type that depends on a template's argument.
template <typename Real>
struct LaneTypes;
template <>
struct LaneTypes<double> {
  static constexpr size_t n = 4;
  using Integer = int64_t;
  using Lanes = double __attribute__((vector_size(32)));
  using Unaligned = double __attribute__((vector_size(32), aligned(8), may_alias));
  using Mask = int64_t __attribute__((vector_size(32)));
};
template <>
struct LaneTypes<float> {
  static constexpr size_t n = 8;
  using Integer = int32_t;
  using Lanes = float __attribute__((vector_size(32)));
  using Unaligned = float __attribute__((vector_size(32), aligned(4), may_alias));
  using Mask = int32_t __attribute__((vector_size(32)));
};
template <typename Real>
using LanesOf = typename LaneTypes<Real>::Lanes;
template <typename Real>
using UnalignedLanesOf = typename LaneTypes<Real>::Unaligned;
template <typename Real>
using LaneMaskOf = typename LaneTypes<Real>::Mask;

inline constexpr size_t n_lanes = LaneTypes<double>::n;
using Lanes = LanesOf<double>;
using LaneMask = LaneMaskOf<double>;

/// In a fixed order, in double.
template <typename L>
double sum_of_lanes(const L* lanes) {
  double sum = 0;
  for (size_t k = 0; k < sizeof(L) / sizeof((*lanes)[0]); ++k) sum += (*lanes)[k];
  return sum;
}

/// R (row-major) and t as plain numbers.
template <typename Real>
struct RigidMotionOf {
  std::array<Real, 9> r;
  std::array<Real, 3> t;
  explicit RigidMotionOf(const SE3& T) {
    const Eigen::Matrix3d m = T.rotation().toRotationMatrix();
    for (int i = 0; i < 9; ++i) r[i] = static_cast<Real>(m(i / 3, i % 3));
    for (int i = 0; i < 3; ++i) t[i] = static_cast<Real>(T.translation()[i]);
  }
};
using RigidMotion = RigidMotionOf<double>;

/// A point nearer than this to the camera plane counts as behind it (m).
inline constexpr double min_depth_m = 1e-3;

}  // namespace sextant
