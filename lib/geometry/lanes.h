#pragma once

// SIMD vectors of 32 bytes (four doubles or eight floats) for the loops over points (base/simd.h).

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "sextant/base/simd.h"
#include "sextant/geometry/se3.h"

// Macros, not functions: a function that returns a vector would have different calling conventions in the
// clones.
#define SEXTANT_LOAD(pointer) \
  (*reinterpret_cast<const ::sextant::UnalignedLanesOf<std::remove_cvref_t<decltype(*(pointer))>>*>(pointer))
#define SEXTANT_STORE(pointer, value)                                                                    \
  (*reinterpret_cast<::sextant::UnalignedLanesOf<std::remove_cvref_t<decltype(*(pointer))>>*>(pointer) = \
       (value))

namespace sextant {

/// Alignment of objects that contain lanes and are passed by address to a SEXTANT_SIMD function: declare them
/// alignas(lane_bytes), because the AVX clone assumes this alignment and its caller does not provide it
/// otherwise.
inline constexpr size_t lane_bytes = 32;

/// Bound of the relative rounding error of a sum of thousands of non-negative numbers.
template <typename Real>
inline constexpr double rounding_of_sums = sizeof(Real) == 4 ? 1e-6 : 1e-12;

// GCC ignores vector_size on a type that depends on a template parameter.
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

/// Returns the sum of the lanes in double precision, added in a fixed order.
template <typename L>
double sum_of_lanes(const L* lanes) {
  double sum = 0;
  for (size_t k = 0; k < sizeof(L) / sizeof((*lanes)[0]); ++k) sum += (*lanes)[k];
  return sum;
}

/// A rigid motion as plain numbers: R (row-major) and t.
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

/// Points with a depth below this value count as behind the camera (m).
inline constexpr double min_depth_m = 1e-3;

}  // namespace sextant
