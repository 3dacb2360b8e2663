#include "sextant/base/philox.h"

#include <gtest/gtest.h>

#include <vector>

namespace sextant {
namespace {

// Random123, tests/kat_vectors, the three lines "philox4x32 10": counter, key, result.
TEST(Philox, GivesThePublishedKnownAnswers) {
  EXPECT_EQ(philox4x32({0, 0}, {0, 0, 0, 0}), (PhiloxWords{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox4x32({0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}),
            (PhiloxWords{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0xa4093822, 0x299f31d0}, {0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}),
            (PhiloxWords{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(UnitInterval, ExcludesZeroAndIncludesOne) {
  EXPECT_EQ(unit_interval(0, 0), 0x1p-53);
  EXPECT_EQ(unit_interval(0xffffffff, 0xffffffff), 1.0);
  EXPECT_EQ(unit_interval(0x80000000, 0), 0.5 + 0x1p-53);
}

TEST(PhiloxStream, RepeatsItselfAndDiffersBetweenStreamsAndSeeds) {
  PhiloxStream a(7, 3), same(7, 3), other_stream(7, 4), other_seed(8, 3);
  for (int i = 0; i < 100; ++i) {
    const uint64_t bits = a.bits();
    EXPECT_EQ(bits, same.bits());
    EXPECT_NE(bits, other_stream.bits());
    EXPECT_NE(bits, other_seed.bits());
  }
}

TEST(PhiloxStream, BelowIsUniform) {
  PhiloxStream stream(1, 0);
  constexpr int n = 70000;
  std::vector<int> counts(7, 0);
  for (int i = 0; i < n; ++i) ++counts.at(stream.below(7));
  double chi2 = 0;
  for (const int count : counts) chi2 += (count - n / 7.0) * (count - n / 7.0) / (n / 7.0);
  EXPECT_LT(chi2, 22.46);  // 0.999 quantile of chi-square with 6 degrees of freedom
  EXPECT_THROW(stream.below(0), InternalError);
}

}  // namespace
}  // namespace sextant
