#include "sextant/stats/change_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/philox.h"

namespace sextant {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

double normal(PhiloxStream& random) {
  return std::sqrt(-2 * std::log(random.uniform())) * std::cos(2 * M_PI * random.uniform());
}

TEST(ChangePoints, ExactSeriesChangeWhereTheyStep) {
  const std::vector<double> values = {1, 1, 1, 1.2, 1.2, 1.2, 1.2, 0.9};
  EXPECT_THAT(change_points(values, 0.05), ElementsAre(3, 7));
  EXPECT_THAT(change_points(values, 0), ElementsAre(3, 7));
  EXPECT_THAT(change_points(values, 0.25), ElementsAre(7));
  EXPECT_THAT(change_points(values, 1), IsEmpty());
  EXPECT_THAT(change_points(std::vector<double>{1, 2}, 0.5), ElementsAre(1));
  EXPECT_THAT(change_points(std::vector<double>{1}, 0.5), IsEmpty());
}

TEST(ChangePoints, NoiseAloneHasNoneAndAStepOfFourSigmaIsFoundWhereItIs) {
  int n_false = 0, n_found = 0;
  for (uint64_t draw = 1; draw <= 50; ++draw) {
    PhiloxStream random(draw, 0);
    std::vector<double> values;
    for (int i = 0; i < 30; ++i) values.push_back(100 + normal(random));
    n_false += !change_points(values, 1).empty();
    for (size_t i = 18; i < values.size(); ++i) values[i] += 4;
    n_found += change_points(values, 1) == std::vector<size_t>{18};
  }
  EXPECT_LE(n_false, 2);
  EXPECT_GE(n_found, 40);
}

TEST(ChangePoints, OneDisturbedValueIsNoChange) {
  std::vector<double> values;
  PhiloxStream random(3, 0);
  for (int i = 0; i < 20; ++i) values.push_back(100 + normal(random));
  values[9] += 8;
  EXPECT_THAT(change_points(values, 1), IsEmpty());
}

TEST(ChangePoints, RefusesWhatIsNotFinite) {
  EXPECT_THROW(change_points(std::vector<double>{1, NAN}, 0.1), Error);
  EXPECT_THROW(change_points(std::vector<double>{1, 2}, -1), Error);
}

}  // namespace
}  // namespace sextant
