#include "sextant/metrics/trajectory_association.h"

#include <gmock/gmock.h>

namespace sextant {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Association, TheShorterTakesTheNearestOfTheLonger) {
  const Association a =
      associate_by_time({0.0, 0.1, 0.2, 0.3, 0.4}, {0.104, 0.289, 0.75}, {.max_difference_s = 0.02});
  EXPECT_THAT(a.reference, ElementsAre(1, 3));
  EXPECT_THAT(a.estimate, ElementsAre(0, 1));
}

TEST(Association, AnOffsetMovesTheEstimate) {
  const Association a = associate_by_time({10.0, 10.1, 10.2}, {0.0, 0.1}, {.offset_s = 10.1});
  EXPECT_THAT(a.reference, ElementsAre(1, 2));
  const Association b = associate_by_time({10.0, 10.1}, {0.0, 0.1, 0.2}, {.offset_s = 9.9});
  EXPECT_THAT(b.estimate, ElementsAre(1, 2));
}

TEST(Association, OfTwoAsNearTheEarlierAndOneMayServeTwice) {
  const Association a = associate_by_time({0.0, 1.0, 2.0}, {0.5, 0.75}, {.max_difference_s = 0.5});
  EXPECT_THAT(a.reference, ElementsAre(0, 1));
  const Association b = associate_by_time({0.0, 1.0, 5.0}, {0.9, 1.1}, {.max_difference_s = 0.5});
  EXPECT_THAT(b.reference, ElementsAre(1, 1));
}

TEST(Association, NothingNear) { EXPECT_THAT(associate_by_time({0.0, 1.0}, {0.5}, {}).reference, IsEmpty()); }

TEST(Association, ByFrameTakesWhatBothHave) {
  const Association a = associate_by_frame({2, 3, 4, 7}, {0, 3, 5, 7, 9});
  EXPECT_THAT(a.reference, ElementsAre(1, 3));
  EXPECT_THAT(a.estimate, ElementsAre(1, 3));
}

}  // namespace
}  // namespace sextant
