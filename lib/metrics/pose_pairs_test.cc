#include "sextant/metrics/pose_pairs.h"

#include <gmock/gmock.h>

#include "sextant/base/error.h"

namespace sextant {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

/// Along x, one pose a metre and 0.1 s, turning 10 deg each.
PoseSeries steady(int n) {
  PoseSeries s;
  for (int i = 0; i < n; ++i) {
    s.add(Eigen::AngleAxisd(i * EIGEN_PI / 18, Eigen::Vector3d::UnitY()).toRotationMatrix(),
          Eigen::Vector3d(i, 0, 0));
    s.stamps_s.push_back(0.1 * i);
  }
  return s;
}

std::vector<PosePair> pairs(const PoseSeries& series, const std::string& text, bool all) {
  PairSelection s = PairSelection::parse(text);
  s.all_pairs = all;
  return select_pairs(series, s);
}

TEST(PosePairs, Frames) {
  EXPECT_THAT(pairs(steady(6), "2f", false), ElementsAre(Pair(0, 2), Pair(2, 4)));
  EXPECT_THAT(pairs(steady(6), "3f", true), ElementsAre(Pair(0, 3), Pair(1, 4), Pair(2, 5)));
}

TEST(PosePairs, MetresBeginWhereTheDistanceIsFirstReached) {
  EXPECT_THAT(pairs(steady(9), "2.5m", false), ElementsAre(Pair(3, 6)));
  EXPECT_THAT(pairs(steady(6), "3m", true), ElementsAre(Pair(0, 3), Pair(1, 4), Pair(2, 5)));
}

TEST(PosePairs, MetresOfAStandstillTakeTheFirstPose) {
  PoseSeries s = steady(4);
  for (int i = 0; i < 3; ++i) s.add(s.rotations[3], s.positions_m[3]);  // poses 4..6 stand at pose 3
  s.stamps_s.clear();
  EXPECT_THAT(pairs(s, "2m", true), ElementsAre(Pair(0, 2), Pair(1, 3)));
}

TEST(PosePairs, Angles) {
  EXPECT_THAT(pairs(steady(6), "19.9deg", false), ElementsAre(Pair(0, 2), Pair(2, 4)));
  EXPECT_THAT(pairs(steady(5), "30deg", true), ElementsAre(Pair(0, 3), Pair(1, 4)));
  EXPECT_THAT(pairs(steady(5), "0.5236rad", true), ElementsAre(Pair(0, 3), Pair(1, 4)));
}

TEST(PosePairs, Seconds) {
  EXPECT_THAT(pairs(steady(6), "0.2s", false), ElementsAre(Pair(0, 2), Pair(2, 4)));
  EXPECT_THAT(pairs(steady(5), "0.3s", true), ElementsAre(Pair(0, 3), Pair(1, 4)));
  PoseSeries no_stamps = steady(5);
  no_stamps.stamps_s.clear();
  EXPECT_THROW(pairs(no_stamps, "0.2s", false), Error);
}

TEST(PosePairs, NoPairIsAnError) {
  EXPECT_THROW(pairs(steady(5), "5f", false), Error);
  EXPECT_THROW(pairs(steady(5), "100m", false), Error);
  EXPECT_THROW(pairs(steady(5), "100m", true), Error);
  EXPECT_THROW(pairs(steady(5), "170deg", true), Error);
}

TEST(PosePairs, ParseRefusesWhatIsNoDistance) {
  for (const char* text : {"", "f", "1", "1x", "0f", "-1m", "1.5f", "nanm", "200deg", "4rad", "1 f"})
    EXPECT_THROW(PairSelection::parse(text), Error) << text;
  EXPECT_EQ(PairSelection::parse("0.5rad").text(), "0.5rad");
}

}  // namespace
}  // namespace sextant
