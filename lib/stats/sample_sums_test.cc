#include "sextant/stats/sample_sums.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/base/philox.h"

namespace sextant {
namespace {

TEST(LogHistogram, CentresAreWithinAQuarterOfAPercent) {
  PhiloxStream random(1, 0);
  for (int i = 0; i < 100000; ++i) {
    const double value = std::exp2(-60 + 120 * random.uniform());
    EXPECT_NEAR(LogHistogram::centre(LogHistogram::bin_of(value)) / value, 1, 0.0025);
  }
}

TEST(LogHistogram, BinsAreHalfAPercentWideAndLeaveNothingOut) {
  for (int bin = -3000; bin < 3000; ++bin) {
    const double low = std::exp2(static_cast<double>(bin) / LogHistogram::bins_per_octave);
    const double inside = low * (1 + 1e-12);
    EXPECT_EQ(LogHistogram::bin_of(inside), bin);
    EXPECT_EQ(LogHistogram::bin_of(low * (1 - 1e-12)), bin - 1);
    EXPECT_EQ(LogHistogram::bin_of(inside * 1.00499), bin);
    EXPECT_EQ(LogHistogram::bin_of(inside * 1.00501), bin + 1);
  }
}

TEST(LogHistogram, TakesEveryNumberFromZeroToTheLargest) {
  EXPECT_EQ(LogHistogram::bin_of(0), LogHistogram::zero_bin);
  EXPECT_EQ(LogHistogram::centre(LogHistogram::zero_bin), 0);
  EXPECT_EQ(LogHistogram::bin_of(1), 0);
  EXPECT_GT(LogHistogram::bin_of(std::numeric_limits<double>::denorm_min()), LogHistogram::zero_bin);
  EXPECT_EQ(LogHistogram::bin_of(std::numeric_limits<double>::max()), 1024 * LogHistogram::bins_per_octave - 1);
  EXPECT_THROW(LogHistogram::bin_of(-1e-300), Error);
  EXPECT_THROW(LogHistogram::bin_of(std::nan("")), Error);
  EXPECT_THROW(LogHistogram::bin_of(std::numeric_limits<double>::infinity()), Error);
}

TEST(LogHistogram, CountsInAnyOrderAreTheSame) {
  LogHistogram rising, falling;
  for (int i = 0; i < 1000; ++i) rising.add(0.001 * (i % 200));
  for (int i = 999; i >= 0; --i) falling.add(0.001 * (i % 200));
  EXPECT_EQ(rising, falling);
  EXPECT_EQ(rising.n(), 1000U);
  EXPECT_EQ(rising.bins().front(), (LogHistogram::Bin{LogHistogram::zero_bin, 5}));
}

}  // namespace
}  // namespace sextant
