#include "sextant/eval/evaluation/object_evaluation.h"

#include <gtest/gtest.h>

namespace sextant {
namespace {

TEST(Ranges, SuccessiveFramesAreOneGroup) {
  EXPECT_EQ(ranges_text({1, 2, 3, 7, 9, 10}), "1-3, 7, 9-10");
  EXPECT_EQ(ranges_text({1, 3, 5, 7}, 2), "1, 3 and 2 more");
}

}  // namespace
}  // namespace sextant
