#include "sextant/truth/truth.h"

#include <gtest/gtest.h>

#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

const Eigen::Quaterniond identity = Eigen::Quaterniond::Identity();

ObjectTruth object(int id, const SE3& T_camera_object) {
  ObjectTruth truth{.id = id, .T_camera_object = T_camera_object};
  return truth;
}

/// The camera drives 1 m ahead. Car 4, 10 m ahead of it, drives 3 m ahead and turns right by 0.1 rad; car 9
/// appears in one frame only.
class SequenceTruthTest : public ::testing::Test {
 protected:
  SequenceTruthTest() {
    truth_.camera.set(7, SE3(identity, {0, 0, 100}));
    truth_.camera.set(8, SE3(identity, {0, 0, 101}));
    truth_.objects[7] = {object(4, SE3(identity, {2, 1, 10}))};
    truth_.objects[8] = {object(4, SE3(turned_, {2, 1, 12})), object(9, SE3(identity, {0, 0, 30}))};
  }

  Eigen::Quaterniond turned_{Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY())};
  SequenceTruth truth_;
};

TEST_F(SequenceTruthTest, FindsObjectsByFrameAndId) {
  ASSERT_NE(truth_.find(8, 9), nullptr);
  EXPECT_EQ(truth_.find(8, 9)->id, 9);
  EXPECT_EQ(truth_.find(7, 9), nullptr);
  EXPECT_EQ(truth_.find(6, 4), nullptr);
}

TEST_F(SequenceTruthTest, TheBackgroundMovesAgainstTheCamera) {
  const std::optional<SE3> X = truth_.background_motion(7, 8);
  ASSERT_TRUE(X.has_value());
  EXPECT_THAT(*X, SE3Near(SE3(identity, {0, 0, -1}), 1e-15));
  // A lamp post 20 m ahead of the camera is 19 m ahead of it afterwards.
  EXPECT_THAT(*X * Eigen::Vector3d(3, 0, 20), EigenNear(Eigen::Vector3d(3, 0, 19), 1e-14));
}

TEST_F(SequenceTruthTest, ObjectMotionMapsTheObjectsPoints) {
  const std::optional<SE3> X = truth_.object_motion(4, 7, 8);
  ASSERT_TRUE(X.has_value());
  const Eigen::Vector3d on_object(0.5, -0.2, 1.7);
  const Eigen::Vector3d before = SE3(identity, {2, 1, 10}) * on_object;
  const Eigen::Vector3d after = SE3(turned_, {2, 1, 12}) * on_object;
  EXPECT_THAT(*X * before, EigenNear(after, 1e-14));
}

TEST_F(SequenceTruthTest, TheMotionInTheWorldIsThatOfThePaper) {
  // H_world = T_world_curr X T_world_prev^-1 moves the object's points in world coordinates
  // (docs/method.md).
  const SE3 H = *truth_.camera.pose(8) * *truth_.object_motion(4, 7, 8) * truth_.camera.pose(7)->inverse();
  const Eigen::Vector3d origin_before(2, 1, 110);
  EXPECT_THAT(H * origin_before, EigenNear(Eigen::Vector3d(2, 1, 113), 1e-12));
}

TEST_F(SequenceTruthTest, AParkedCarMovesWithTheBackground) {
  truth_.objects[7].push_back(object(5, SE3(identity, {-3, 1, 20})));
  truth_.objects[8].push_back(object(5, SE3(identity, {-3, 1, 19})));
  EXPECT_THAT(*truth_.object_motion(5, 7, 8), SE3Near(*truth_.background_motion(7, 8), 1e-14));
}

TEST_F(SequenceTruthTest, MissingTruthIsNoMotion) {
  EXPECT_FALSE(truth_.background_motion(8, 9).has_value());
  EXPECT_FALSE(truth_.object_motion(9, 7, 8).has_value());
  EXPECT_FALSE(truth_.object_motion(4, 8, 9).has_value());
  EXPECT_FALSE(truth_.object_motion(123, 7, 8).has_value());
}

}  // namespace
}  // namespace sextant
