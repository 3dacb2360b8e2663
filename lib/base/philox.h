#pragma once

// Philox 4x32-10, a counter-based random number generator: the value for a counter does not depend on earlier
// values, so that values can be computed in any order and on any thread.
//   J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw: Parallel Random Numbers: As Easy as 1, 2, 3, SC'11.
// Checked in philox_test.cc against the known answers published with the authors' Random123 library.

#include <array>
#include <bit>
#include <cstdint>

#include "sextant/base/error.h"
#include "sextant/base/simd.h"

namespace sextant {

struct PhiloxKey {
  uint32_t k0 = 0;
  uint32_t k1 = 0;
};

using PhiloxWords = std::array<uint32_t, 4>;

/// Returns four random 32-bit words for a counter. Always inlined, because callers run it in loops over
/// arrays that the compiler vectorises.
SEXTANT_INLINED PhiloxWords philox4x32(PhiloxKey key, PhiloxWords c) {
  for (int round = 0; round < 10; ++round) {
    const uint64_t a = uint64_t{0xD2511F53U} * c[0];
    const uint64_t b = uint64_t{0xCD9E8D57U} * c[2];
    c = {static_cast<uint32_t>(b >> 32) ^ c[1] ^ key.k0, static_cast<uint32_t>(b),
         static_cast<uint32_t>(a >> 32) ^ c[3] ^ key.k1, static_cast<uint32_t>(a)};
    key.k0 += 0x9E3779B9U;  // golden ratio
    key.k1 += 0xBB67AE85U;  // sqrt(3) - 1
  }
  return c;
}

/// Maps 64 random bits to a number in (0, 1]: (the upper 53 bits + 1) / 2^53. Exact, hence equal on every
/// machine.
SEXTANT_INLINED double unit_interval(uint32_t high, uint32_t low) {
  // 32-bit integers become doubles through the bit pattern of 2^52 + integer: unlike a 64-bit conversion,
  // this vectorises on every target. Every step is exact.
  const auto exact = [](uint64_t word) { return std::bit_cast<double>(word | 0x4330000000000000U) - 0x1p52; };
  return (exact(high) * 0x1p21 + (exact(low >> 11) + 1)) * 0x1p-53;
}

/// A sequence of random numbers for resampling. The streams of one seed are independent of each other, so
/// that each replicate can use a stream of its own on any thread.
class PhiloxStream {
 public:
  PhiloxStream(uint64_t seed, uint64_t stream)
      : key_{static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32)}, stream_(stream) {}

  uint64_t bits() {
    if (left_ == 0) {
      words_ = philox4x32(key_, {static_cast<uint32_t>(counter_), static_cast<uint32_t>(counter_ >> 32),
                                 static_cast<uint32_t>(stream_), static_cast<uint32_t>(stream_ >> 32)});
      ++counter_;
      left_ = 2;
    }
    --left_;
    return (uint64_t{words_[2 * left_]} << 32) | words_[2 * left_ + 1];
  }
  /// Returns a number uniformly distributed in (0, 1].
  double uniform() {
    const uint64_t b = bits();
    return unit_interval(static_cast<uint32_t>(b >> 32), static_cast<uint32_t>(b));
  }
  /// Returns an integer uniformly distributed in [0, n); n > 0. The bias, below n / 2^64, is negligible here.
  uint64_t below(uint64_t n) {
    SEXTANT_CHECK(n > 0);
    return static_cast<uint64_t>((static_cast<unsigned __int128>(bits()) * n) >> 64);
  }

 private:
  PhiloxKey key_;
  uint64_t stream_;
  uint64_t counter_ = 0;
  PhiloxWords words_{};
  int left_ = 0;
};

}  // namespace sextant
