#include "sextant/eval/evaluation/pose_frames.h"

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/geometry/axes.h"
#include "sextant/geometry/testing.h"

namespace sextant {
namespace {

PoseSeries one(const SE3& T) {
  PoseSeries s;
  s.add(T);
  return s;
}

SE3 some_motion(int seed) {
  std::mt19937_64 generator(static_cast<uint64_t>(seed));
  return SE3::exp(random_twist(generator, 5, 2));
}

TEST(PoseFrame, TheBodyComesBeforeTheCamera) {
  const SE3 T_world_body = some_motion(1), T_body_camera = some_motion(2);
  PoseFrame frame;
  frame.body_from_camera = {T_body_camera.translation(), T_body_camera.rotation().toRotationMatrix()};
  PoseSeries s = one(T_world_body);
  to_camera(s, frame);
  EXPECT_THAT(s.pose(0), SE3Near(T_world_body * T_body_camera, 1e-13));
  EXPECT_THAT(frame.matrix(), EigenNear(T_body_camera.matrix(), 1e-15));
}

TEST(PoseFrame, AxesChangeWorldAndBody) {
  // A drone in north-east-down flies 3 m east, nose to the east, 2 m up.
  PoseSeries s;
  s.add(Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {0, 3, -2});
  PoseFrame frame;
  frame.axes = Axes::ned;
  to_camera(s, frame);
  EXPECT_THAT(s.positions_m[0], EigenNear(Eigen::Vector3d(3, -2, 0), 1e-15)) << "right 3, up 2, forward 0";
  EXPECT_THAT(s.rotations[0] * Eigen::Vector3d::UnitZ(), EigenNear(Eigen::Vector3d(1, 0, 0), 1e-15));
  EXPECT_THAT(s.rotations[0] * Eigen::Vector3d::UnitY(), EigenNear(Eigen::Vector3d(0, 1, 0), 1e-15));
}

TEST(PoseFrame, ALeverArmAloneIsAlongTheBodysAxes) {
  PoseFrame frame{.axes = Axes::flu, .body_from_camera = parse_body_from_camera("1.5, 0, 0.3")};
  const SE3 T = some_motion(3);
  PoseSeries s = one(T);
  to_camera(s, frame);
  EXPECT_THAT(s.positions_m[0],
              EigenNear(opencv_from_axes(Axes::flu) * (T * Eigen::Vector3d(1.5, 0, 0.3)), 1e-14));
}

TEST(PoseFrame, NothingGivenChangesNoBit) {
  PoseSeries s = one(some_motion(4));
  s.rotations[0](1, 1) += 1e-7;
  const PoseSeries before = s;
  to_camera(s, {});
  EXPECT_EQ(s.rotations[0], before.rotations[0]);
  EXPECT_EQ(s.positions_m[0], before.positions_m[0]);
}

TEST(BodyFromCamera, IsReadFromTextAndFiles) {
  EXPECT_EQ(parse_body_from_camera("1 2 3").position_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(parse_body_from_camera("1,2,3").rotation);
  EXPECT_EQ(parse_body_from_camera("0 -1 0 1 1 0 0 2 0 0 1 3").position_m, Eigen::Vector3d(1, 2, 3));
  TempFolder folder;
  const std::string file = folder.write("T.txt", "# T_body_camera\n0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n");
  EXPECT_EQ((*parse_body_from_camera(file).rotation)(0, 1), -1);
  EXPECT_EQ(parse_body_from_camera(file).position_m, Eigen::Vector3d(1, 2, 3));
}

TEST(BodyFromCamera, BadOnesAreNamed) {
  const auto error = [](const std::string& text) { return error_of([&] { parse_body_from_camera(text); }); };
  EXPECT_THAT(error("no/such/file"), HasSubstr("there is no file 'no/such/file'"));
  EXPECT_THAT(error("1 2"), HasSubstr("got 2"));
  EXPECT_THAT(error("1 2 nan"), HasSubstr("no list of"));
  EXPECT_THAT(error("1 2 1e9"), HasSubstr("expected metres"));
  EXPECT_THAT(error("1 0 0 1 0 1 0 2 0 0 2 3"), HasSubstr("rotation matrix"));
  EXPECT_THAT(error("1 0 0 1 0 1 0 2 0 0 -1 3"), HasSubstr("reflection"));
  EXPECT_THAT(error("1 0 0 1 0 1 0 2 0 0 1 3 0 0 1 1"), HasSubstr("0 0 0 1 as the last row"));
  TempFolder folder;
  EXPECT_THAT(error(folder.path().string()), HasSubstr("expected a file"));
  EXPECT_THAT(error(folder.write("empty.txt", "")), HasSubstr("got 0"));
  EXPECT_THAT(error(folder.write("long.txt", std::string(100000, '1'))), HasSubstr("beyond"));
}

TEST(Direction, NamesAndNumbers) {
  EXPECT_EQ(parse_direction("-y"), Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(parse_direction("z"), Eigen::Vector3d(0, 0, 1));
  EXPECT_THAT(parse_direction("0 3 -4"), EigenNear(Eigen::Vector3d(0, 0.6, -0.8), 1e-15));
  for (const char* text : {"", "w", "0 0 0", "1 2", "--y", "nan 0 1"})
    EXPECT_THROW(parse_direction(text), Error);
}

}  // namespace
}  // namespace sextant
