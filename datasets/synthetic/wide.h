#pragma once

// Loops that take eight values at a time where the processor can. The numbers are the same either way: only
// operations that IEEE 754 defines exactly are used, and none are fused.

#include <bit>
#include <cstdint>

#if defined(__x86_64__) && !defined(SEXTANT_NARROW) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SEXTANT_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define SEXTANT_WIDE
#endif
/// For what such loops call: a call would keep them from being vectorised.
#define SEXTANT_INLINED [[gnu::always_inline]] inline

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
