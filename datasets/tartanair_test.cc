#include "sextant/datasets/tartanair.h"

#include <algorithm>

#include "sextant/datasets/tartanair_testing.h"
#include "sextant/datasets/testing.h"

namespace sextant {
namespace {

class Tartanair : public FolderTest {
 protected:
  Tartanair() : FolderTest("Tiny/Data_easy/P000"), truth_(write_tartanair_trajectory(root_, 3)) {}
  std::string source(const std::string& rest = "") const { return "tartanair:" + root_.string() + rest; }

  SequenceTruth truth_;
};

TEST_F(Tartanair, OpensTheFolderOfATrajectoryAndTheRootOfAll) {
  EXPECT_EQ(text_of(open_with(source())->info()), "tartanair Tiny/Data_easy/P000@0-2, 640x640 px, 10 Hz");
  EXPECT_EQ(open_with(source("/"))->info().sequence, "Tiny/Data_easy/P000");
  const std::string root = "tartanair:" + temp_.path().string();
  EXPECT_EQ(text_of(open_with(root + "#Tiny/Data_easy/P000@1-2")->info()),
            "tartanair Tiny/Data_easy/P000@1-2, 640x640 px, 10 Hz");
  expect_error([&] { open_with(root); }, "choose a trajectory");
  expect_error([&] { open_with(root + "#Tiny/Data_easy/P001"); }, "available: Tiny/Data_easy/P000");
  const StereoCamera camera = open_with(source())->info().camera;
  EXPECT_EQ(camera.left.fx, 320);
  EXPECT_EQ(camera.left.cy, 320);
  EXPECT_EQ(camera.bf, 80);
}

TEST_F(Tartanair, DepthFlowAndPosesAgree) {
  const auto sequence = open_with(source());
  const PinholeCamera& camera = sequence->info().camera.left;
  const Frame frame = sequence->read(0, {.depth = true, .flow = true});
  EXPECT_FALSE(std::isfinite(frame.depth_m(1, 2))) << "sky";
  EXPECT_FALSE(frame.flow(3, 4).valid()) << "masked";
  const SE3 T_next_camera = *sequence->truth().background_motion(0, 1);
  for (const auto& [x, y] : std::vector<std::pair<int, int>>{{10, 10}, {320, 320}, {600, 30}, {77, 611}}) {
    const Eigen::Vector2d q = camera.project(T_next_camera * camera.backproject(x, y, frame.depth_m(x, y)));
    EXPECT_NEAR(frame.flow(x, y).u, q.x() - x, 0.51 / 64);
    EXPECT_NEAR(frame.flow(x, y).v, q.y() - y, 0.51 / 64);
  }
}

TEST_F(Tartanair, PosesAreTurnedFromNedToCameraAxes) {
  const SE3 step =
      open_with(source())->truth().camera.pose(0)->inverse() * *open_with(source())->truth().camera.pose(1);
  EXPECT_LT((step.translation() - Eigen::Vector3d(0.02, 0.05, 0.1)).norm(), 1e-12) << "right, down, ahead";
}

TEST_F(Tartanair, PartsMayBeMissing) {
  remove("image_rcam_front");
  remove("flow_lcam_front");
  const auto computed = open_with(source());
  EXPECT_TRUE(computed->info().channels.flow && computed->info().channels.depth);
  EXPECT_FALSE(computed->info().exact.flow);
  remove("image_lcam_front");
  remove("depth_lcam_front");
  const auto text = open_with(source());
  EXPECT_EQ(text->info().last_frame, 2);
  EXPECT_FALSE(text->info().channels.depth || text->info().channels.gray);
}

TEST_F(Tartanair, DamageIsNamed) {
  const std::string poses = text("pose_lcam_front.txt");
  put("pose_lcam_front.txt", poses + "1 2 3 0 0 0\n");
  expect_error([&] { open_with(source()); }, file("pose_lcam_front.txt") +
                                                 ":4: expected tx ty tz qx qy qz "
                                                 "qw");
  put("pose_lcam_front.txt", poses + "1 2 3 0 0 0 2\n");
  expect_error([&] { open_with(source()); }, ":4: quaternion of norm 2");
  put("pose_lcam_front.txt", poses.substr(0, poses.find('\n') + 1));
  expect_error([&] { open_with(source()); }, "it has 1 lines, but frame 2 needs line 3");
  put("pose_lcam_front.txt", "");
  expect_error([&] { open_with(source()); }, "holds no pose");
  put("pose_lcam_front.txt", poses);
  put("depth_lcam_front/000001_lcam_front_depth.png", encode_png(Image<uint16_t>(640, 640)));
  expect_error([&] { open_with(source())->read(1, {.depth = true}); }, "expected a PNG of 8-bit RGBA");
  remove("pose_lcam_front.txt");
  EXPECT_THAT(open_with(source())->info().warnings, testing::Contains(HasSubstr("no true camera motion")));
}

TEST(TartanairReal, TenFramesOpen) {
  SEXTANT_NEEDS_DATA("tartanair2_abs_P000");
  const auto sequence = open_with("tartanair:" + real_data("tartanair2_abs_P000").string());
  EXPECT_EQ(text_of(sequence->info()), "tartanair tartanair2_abs_P000@0-9, 640x640 px, 10 Hz");
  EXPECT_EQ(sequence->truth().camera.poses().size(), 1360U);
  const Frame frame = sequence->read(0, {.depth = true, .flow = true});
  const auto is_known = [](float z) { return z > 0.5 && z < 5000; };
  EXPECT_GT(std::count_if(frame.depth_m.data(), frame.depth_m.data() + frame.depth_m.size(), is_known),
            640 * 320);
}

}  // namespace
}  // namespace sextant
