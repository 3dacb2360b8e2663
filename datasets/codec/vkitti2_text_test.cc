#include "sextant/datasets/codec/vkitti2_text.h"

#include "sextant/base/testing.h"

namespace sextant {
namespace {

const std::string pose_header =
    "frame cameraID trackID alpha width height length world_space_X world_space_Y world_space_Z "
    "rotation_world_space_y rotation_world_space_x rotation_world_space_z camera_space_X camera_space_Y "
    "camera_space_Z rotation_camera_space_y rotation_camera_space_x rotation_camera_space_z\n";

TEST(Vkitti2Text, PosesAsTheDataSetHasThem) {
  // The first row of Scene18/clone/pose.txt.
  const auto poses = decode_vkitti2_poses(
      pose_header +
          "25 0 0 1.69414 1.776562 1.421875 3.617188 53.18796 -106 79.85496 2.263542 0 0 -3.088518 "
          "1.056862 55.55215 1.638601 -0.01539355 0.03731001\r\n\r\n",
      "pose.txt");
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_EQ(poses[0].frame, 25);
  EXPECT_EQ(poses[0].size_m, Eigen::Vector3d(1.776562, 1.421875, 3.617188));
  EXPECT_EQ(poses[0].world_m, Eigen::Vector3d(53.18796, -106, 79.85496));
  EXPECT_EQ(poses[0].world_angles.ry, 2.263542);
  EXPECT_EQ(poses[0].camera_m, Eigen::Vector3d(-3.088518, 1.056862, 55.55215));
  EXPECT_EQ(poses[0].camera_angles.ry, 1.638601);
  EXPECT_EQ(poses[0].camera_angles.rx, -0.01539355);
  EXPECT_EQ(poses[0].camera_angles.rz, 0.03731001);
  EXPECT_EQ(encode_vkitti2_poses(poses),
            pose_header +
                "25 0 0 1.69414 1.776562 1.421875 3.617188 53.18796 -106 79.85496 2.263542 0 0 -3.088518 "
                "1.056862 55.55215 1.638601 -0.01539355 0.03731001\n");
}

TEST(Vkitti2Text, ExtrinsicsAndIntrinsicsRoundTrip) {
  const std::vector<Vkitti2Extrinsic> rows = {
      {4, 0, SE3::exp((Vector6d() << 1.25, 107, -3, 0.3, -1.9, 0.02).finished())},
      {4, 1, SE3::exp((Vector6d() << 0.75, 107, -3, 0.3, -1.9, 0.02).finished())}};
  const auto again = decode_vkitti2_extrinsics(encode_vkitti2_extrinsics(rows), "x.txt");
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[1].frame, 4);
  EXPECT_EQ(again[1].camera, 1);
  EXPECT_LT((again[1].T_camera_world.inverse() * rows[1].T_camera_world).log().norm(), 1e-12);

  const std::string text = "frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]\n0 0 725.0087 725.5 620.5 187\n";
  const auto cameras = decode_vkitti2_intrinsics(text, "x.txt");
  EXPECT_EQ(cameras[0].k.fx, 725.0087);
  EXPECT_EQ(cameras[0].k.fy, 725.5);
  EXPECT_EQ(cameras[0].k.cx, 620.5);
  EXPECT_EQ(cameras[0].k.cy, 187);
  EXPECT_EQ(encode_vkitti2_intrinsics(cameras), text);
}

TEST(Vkitti2Text, BoxesInfosAndColorsRoundTrip) {
  const std::string boxes =
      "frame cameraID trackID left right top bottom number_pixels truncation_ratio occupancy_ratio isMoving\n"
      "25 0 7 565 595 181 202 412 0.25 0.6634921 True\n26 0 7 557 591 183 204 420 0 0.5 False\n";
  const auto rows = decode_vkitti2_boxes(boxes, "x.txt");
  EXPECT_EQ(rows[0].box, (ImageBox{565, 181, 595, 202}));
  EXPECT_EQ(rows[0].number_pixels, 412);
  EXPECT_TRUE(rows[0].is_moving);
  EXPECT_FALSE(rows[1].is_moving);
  EXPECT_EQ(encode_vkitti2_boxes(rows), boxes);
  const std::string infos = "trackID label model color\n0 Car Sedan4Door Silver\n4 Van Van White\n";
  EXPECT_EQ(encode_vkitti2_infos(decode_vkitti2_infos(infos, "x.txt")), infos);
}

TEST(Vkitti2Text, BadRows) {
  const std::string extrinsic =
      "frame cameraID r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1\n";
  const std::string row = "0 0 1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n";
  expect_error([&] { decode_vkitti2_extrinsics(extrinsic + row + row, "x.txt"); },
               "x.txt:3: camera 0 appears twice in frame 0");
  expect_error(
      [&] { decode_vkitti2_extrinsics(extrinsic + "0 0 1 0 0 nan 0 1 0 2 0 0 1 3 0 0 0 1\n", "x.txt"); },
      "x.txt:2: expected a finite number");
  expect_error([&] { decode_vkitti2_extrinsics("frame r1,1\n", "x.txt"); },
               "x.txt:1: the first row names no column cameraID, t3");
  const std::string intrinsic = "frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]\n";
  expect_error([&] { decode_vkitti2_intrinsics(intrinsic + "0 0 -725 725 620.5 187\n", "x.txt"); },
               "x.txt:2: expected positive focal lengths");
  const std::string pose = "25 0 0 1 1 1 1 1 1 1 1 0 0 1 1 1 1 1 1\n";
  expect_error([&] { decode_vkitti2_poses(pose_header + pose + pose, "x.txt"); },
               "x.txt:3: track 0 appears twice in frame 25 of camera 0");
  expect_error([&] { decode_vkitti2_poses(pose_header + "25 0 0 1\n", "x.txt"); },
               "x.txt:2: expected 19 values");
  const std::string bbox =
      "frame cameraID trackID left right top bottom number_pixels truncation_ratio occupancy_ratio "
      "isMoving\n";
  expect_error([&] { decode_vkitti2_boxes(bbox + "0 0 1 2 3 4 5 6 0 1 yes\n", "x.txt"); },
               "x.txt:2: expected 0, 1, True or False for isMoving, got 'yes'");
  expect_error([&] { decode_vkitti2_infos("trackID label model color\n1 Car a b\n1 Car a b\n", "x.txt"); },
               "x.txt:3: track 1 appears twice");
}

}  // namespace
}  // namespace sextant
