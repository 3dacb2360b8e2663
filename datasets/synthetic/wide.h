#pragma once

// Functions for loops over eight values at a time (base/simd.h).

#include <bit>
#include <cstdint>

#include "sextant/base/simd.h"

namespace sextant::synthetic::wide {

constexpr int lanes = 8;
/// Rounds up to a multiple of the lanes: loops may run that far past the end, and arrays are large enough
/// for it.
constexpr int whole(int n) { return (n + lanes - 1) / lanes * lanes; }

SEXTANT_INLINED float min(float a, float b) { return a < b ? a : b; }
SEXTANT_INLINED float max(float a, float b) { return a > b ? a : b; }
SEXTANT_INLINED float clamp(float x, float low, float high) { return min(max(x, low), high); }
SEXTANT_INLINED float abs(float x) { return std::bit_cast<float>(std::bit_cast<uint32_t>(x) & 0x7fffffffU); }
/// std::floor for numbers in the range of int32_t; without SSE4.1 the library's version is a function call.
SEXTANT_INLINED int32_t floor_int(float x) {
  const auto towards_zero = static_cast<int32_t>(x);
  return towards_zero - (x < static_cast<float>(towards_zero) ? 1 : 0);
}
SEXTANT_INLINED float mix(float a, float b, float t) { return a + t * (b - a); }

}  // namespace sextant::synthetic::wide
