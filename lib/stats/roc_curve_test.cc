#include "sextant/stats/roc_curve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sextant {
namespace {

TEST(RocCurve, AreaIsTheShareOfPairsInOrder) {
  // Pairs (dynamic, static): 3 > 1, 3 > 2, 2 > 1, and 2 = 2 counts half.
  const auto curve = roc_curve({{3, true}, {2, true}, {2, false}, {1, false}});
  ASSERT_TRUE(curve);
  EXPECT_DOUBLE_EQ(curve->area, 3.5 / 4);
  EXPECT_EQ(curve->positives, 2);
  EXPECT_EQ(curve->negatives, 2);
  ASSERT_EQ(curve->points.size(), 4U);
  EXPECT_DOUBLE_EQ(curve->points[1].true_positive_rate, 0.5);
  EXPECT_DOUBLE_EQ(curve->points[1].false_positive_rate, 0);
  EXPECT_DOUBLE_EQ(curve->points[2].false_positive_rate, 0.5);
  EXPECT_DOUBLE_EQ(curve->points[3].false_positive_rate, 1);
}

TEST(RocCurve, PerfectAndUseless) {
  EXPECT_DOUBLE_EQ(roc_curve({{2, true}, {1, false}})->area, 1);
  EXPECT_DOUBLE_EQ(roc_curve({{1, true}, {2, false}})->area, 0);
  EXPECT_DOUBLE_EQ(roc_curve({{1, true}, {1, false}, {1, false}})->area, 0.5);
}

TEST(RocCurve, NeedsBothKindsAndNumbers) {
  EXPECT_FALSE(roc_curve({}));
  EXPECT_FALSE(roc_curve({{1, true}, {2, true}}));
  EXPECT_FALSE(roc_curve({{1, true}, {NAN, false}}));
}

}  // namespace
}  // namespace sextant
