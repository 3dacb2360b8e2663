#pragma once

// What loops over eight values at a time (base/simd.h) call.

#include <bit>
#include <cstdint>

#include "sextant/base/simd.h"

namespace sextant::synthetic::wide {

constexpr int lanes = 8;
/// Loops may run past the end up to the next multiple of lanes; arrays have room for that.
constexpr int whole(int n) { return (n + lanes - 1) / lanes * lanes; }

SEXTANT_INLINED float min(float a, float b) { return a < b ? a : b; }
SEXTANT_INLINED float max(float a, float b) { return a > b ? a : b; }
SEXTANT_INLINED float clamp(float x, float low, float high) { return min(max(x, low), high); }
SEXTANT_INLINED float abs(float x) { return std::bit_cast<float>(std::bit_cast<uint32_t>(x) & 0x7fffffffU); }
/// std::floor for numbers that fit; without SSE4.1 the library's is a call.
SEXTANT_INLINED int32_t floor_int(float x) {
  const auto towards_zero = static_cast<int32_t>(x);
  return towards_zero - (x < static_cast<float>(towards_zero) ? 1 : 0);
}
SEXTANT_INLINED float mix(float a, float b, float t) { return a + t * (b - a); }

}  // namespace sextant::synthetic::wide
