#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sextant/geometry/testing.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {
namespace {

std::vector<Eigen::Vector3d> cloud(int n) {
  std::mt19937_64 generator(3);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < n; ++i) points.emplace_back(random_twist(generator, 20, 1).head<3>());
  return points;
}

TEST(Umeyama, RecoversASimilarity) {
  std::mt19937_64 generator(5);
  const SE3 T = SE3::exp(random_twist(generator, 30, 3));
  const std::vector<Eigen::Vector3d> x = cloud(40);
  std::vector<Eigen::Vector3d> y;
  for (const Eigen::Vector3d& p : x) y.push_back(T * (1.7 * p));
  const auto found = umeyama(x, y, true);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->y_from_x.scale, 1.7, 1e-12);
  EXPECT_THAT(found->y_from_x.rotation, EigenNear(T.rotation().toRotationMatrix(), 1e-12));
  EXPECT_THAT(found->y_from_x.translation_m, EigenNear(T.translation(), 1e-11));
  EXPECT_EQ(umeyama(x, y, false)->y_from_x.scale, 1);
}

TEST(Umeyama, NeverReflects) {
  const std::vector<Eigen::Vector3d> x = cloud(40);
  std::vector<Eigen::Vector3d> mirrored;
  for (const Eigen::Vector3d& p : x) mirrored.emplace_back(-p[0], p[1], p[2]);
  EXPECT_NEAR(umeyama(x, mirrored, true)->y_from_x.rotation.determinant(), 1, 1e-12);
}

TEST(Umeyama, PointsThatDoNotDetermineTheRotationGiveNoResult) {
  const std::vector<Eigen::Vector3d> x = cloud(10), still(10, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(umeyama(x, still, true));
  EXPECT_FALSE(umeyama(still, x, true));
  EXPECT_FALSE(umeyama(still, still, false));
  EXPECT_FALSE(umeyama({}, {}, false));
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 10; ++i) line.emplace_back(i, 0, 0);
  EXPECT_FALSE(umeyama(line, line, false));
}

TEST(Umeyama, PointsOnALineDetermineTheScale) {
  std::vector<Eigen::Vector3d> line, longer, still(10, {1, 2, 3});
  for (int i = 0; i < 10; ++i) line.emplace_back(i, 0, 2 * i);
  for (const Eigen::Vector3d& p : line) longer.emplace_back(3 * p.y() + 4, 3 * p.x(), 3 * p.z());
  EXPECT_NEAR(umeyama_scale(line, longer).value_or(0), 3, 1e-12);
  EXPECT_FALSE(umeyama_scale(line, still));
  EXPECT_FALSE(umeyama_scale(still, line));
  const std::vector<Eigen::Vector3d> x = cloud(10), y = cloud(10);
  EXPECT_EQ(umeyama_scale(x, y), umeyama(x, y, true)->y_from_x.scale);
}

TEST(Umeyama, FlatnessIdentifiesALine) {
  std::vector<Eigen::Vector3d> slanted;
  for (int i = 0; i < 50; ++i) slanted.emplace_back(0.3 * i, 0.1 * i, 0.7 * i + (i == 20 ? 1e-6 : 0));
  const auto found = umeyama(slanted, slanted, false);
  ASSERT_TRUE(found);
  EXPECT_LT(found->flatness, 1e-12);
  const std::vector<Eigen::Vector3d> x = cloud(10);
  EXPECT_GT(umeyama(x, x, false)->flatness, 0.05);
}

TEST(RotationAbout, RecoversAnAngleAndLeavesTheAxis) {
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -2, 0.3).normalized();
  const SE3 T(Eigen::Quaterniond(Eigen::AngleAxisd(2.3, up)), {4, 5, -6});
  const std::vector<Eigen::Vector3d> x = cloud(40);
  std::vector<Eigen::Vector3d> y, tilted;
  const Eigen::AngleAxisd tilt(0.2, up.unitOrthogonal());
  for (const Eigen::Vector3d& p : x) y.push_back(T * p);
  const auto found = rotation_about(up, x, y);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->rotation, EigenNear(T.rotation().toRotationMatrix(), 1e-12));
  EXPECT_THAT(found->translation_m, EigenNear(T.translation(), 1e-11));
  for (const Eigen::Vector3d& p : y) tilted.push_back(tilt * p);
  EXPECT_THAT(rotation_about(up, x, tilted)->rotation * up, EigenNear(up, 1e-14)) << "a tilt stays an error";
}

TEST(RotationAbout, IsTheLeastOfAllAngles) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const std::vector<Eigen::Vector3d> x = cloud(30);
  std::vector<Eigen::Vector3d> y = cloud(60);
  y.erase(y.begin(), y.begin() + 30);
  const auto found = rotation_about(up, x, y);
  const auto squares = [&](double more) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(more, up).toRotationMatrix() * found->rotation;
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < x.size(); ++i) shift += (y[i] - R * x[i]) / static_cast<double>(x.size());
    double sum = 0;
    for (size_t i = 0; i < x.size(); ++i) sum += (R * x[i] + shift - y[i]).squaredNorm();
    return sum;
  };
  for (double more = 0.05; more < 6.25; more += 0.1) EXPECT_GT(squares(more), squares(0)) << more;
}

TEST(RotationAbout, PointsOnTheAxisGiveNoResult) {
  const std::vector<Eigen::Vector3d> x = cloud(10);
  std::vector<Eigen::Vector3d> on_axis;
  for (const Eigen::Vector3d& p : x) on_axis.emplace_back(1, 2, p[2]);
  EXPECT_FALSE(rotation_about(Eigen::Vector3d::UnitZ(), x, on_axis));
}

}  // namespace

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

TEST(Association, ByFrameMatchesCommonFrames) {
  const Association a = associate_by_frame({2, 3, 4, 7}, {0, 3, 5, 7, 9});
  EXPECT_THAT(a.reference, ElementsAre(1, 3));
  EXPECT_THAT(a.estimate, ElementsAre(1, 3));
}

}  // namespace

}  // namespace sextant
