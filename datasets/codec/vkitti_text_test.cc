#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

constexpr const char* header_row =
    "frame tid label truncated occluded alpha l t r b w3d h3d l3d x3d "
    "y3d z3d ry rx rz truncr occupr orig_label moving model color\n";

// Two poses, world -> camera: rows in the format of the data set, with a header that a table reader has
// mangled.
TEST(Vkitti1Text, ExtrinsicsMapWorldToCamera) {
  const auto poses = decode_vkitti1_extrinsics(
      "\xef\xbb\xbf"
      "frame r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0.1 0.2 1\r\n"
      "\r\n"
      "3 0 0 1 10 0 1 0 20 -1 0 0 30 0 0 0 1\r\n"
      "4 1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\r\n",
      "x.txt");
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_LT((poses.at(3) * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(13, 22, 29)).norm(), 1e-12);
  EXPECT_LT((poses.at(4) * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(2, 4, 6)).norm(), 1e-12);
}

TEST(Vkitti1Text, ExtrinsicsRoundTrip) {
  const std::map<int, SE3> poses = {
      {0, SE3::exp((Vector6d() << 1.25, 107, -3, 0.3, -1.9, 0.02).finished())},
      {7, SE3::exp((Vector6d() << -250.0 / 3, 112, 9, -0.01, 2.5, 0.04).finished())}};
  const auto again = decode_vkitti1_extrinsics(encode_vkitti1_extrinsics(poses), "x.txt");
  ASSERT_EQ(again.size(), 2u);
  for (const auto& [frame, pose] : poses) EXPECT_LT((again.at(frame).inverse() * pose).log().norm(), 1e-12);
}

TEST(Vkitti1Text, BadExtrinsics) {
  const std::string header = "frame r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1\n";
  const std::string good = "0 1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n";
  const auto error = [&](const std::string& text, const char* message) {
    expect_error([&] { decode_vkitti1_extrinsics(text, "x.txt"); }, message);
  };
  error("", "x.txt:0: expected a first row with the names of the columns");
  error(good, "x.txt:1: the first row names no column frame, r1,1, t3");
  error("frame t1 r1,1 t3\n", "x.txt:1: expected the 17 columns frame r1,1");
  error(header + "0 1 0 0 1 0 1 0 2 0 0 1 3\n", "x.txt:2: expected 17 values");
  error(header + "0 1 0 0 nan 0 1 0 2 0 0 1 3 0 0 0 1\n",
        "x.txt:2: expected a finite number for a pose value");
  error(header + "0 2 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n", "x.txt:2: expected a rotation in the pose");
  error(header + "0 1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 2\n", "x.txt:2: expected 0 0 0 1");
  error(header + fmt::format("-1{}", good.substr(1)), "x.txt:2: expected a frame number >= 0, got -1");
  error(header + good + good, "x.txt:3: frame 0 has a pose already");
}

TEST(VkittiTextErrors, BoxesWhoseEdgesAreExchangedAreRefused) {
  const std::string row = " 1.6 1.4 3.8 3 1.4 13 -1.6 0 0 0 0.4 Car 1 Hatchback Black\n";
  expect_error(
      [&] { decode_vkitti1_objects(header_row + ("0 1 Car 0 2 -1.8 722 186 144 281" + row), "motgt.txt"); },
      "motgt.txt:2: expected a box with left <= right and top <= bottom, got left 722");
  expect_error(
      [] {
        decode_vkitti2_boxes(
            "frame cameraID trackID left right top bottom number_pixels truncation_ratio occupancy_ratio "
            "isMoving\n25 0 7 565 595 202 181 412 0.25 0.66 True\n",
            "bbox.txt");
      },
      "bbox.txt:2: expected a box with left <= right and top <= bottom, got left 565");
}

TEST(Vkitti1Text, ObjectsAsTheDataSetHasThem) {
  const auto objects = decode_vkitti1_objects(
      header_row +
          std::string(
              "0 1 DontCare 0 2 -1.796513 722 186 866 281 1.612032 1.404795 3.772344 3.008632 1.41593 "
              "13.15864 -1.571733 0.001502285 -0.07224336 0 0.3971491 Car 1 Hatchback Black\n"),
      "motgt.txt");
  ASSERT_EQ(objects.size(), 1u);
  const Vkitti1Object& o = objects[0];
  EXPECT_EQ(o.tid, 1);
  EXPECT_EQ(o.label, "DontCare");
  EXPECT_EQ(o.occluded, 2);
  EXPECT_EQ(o.box, (ImageBox{722, 186, 866, 281}));
  EXPECT_EQ(o.size_m, Eigen::Vector3d(1.612032, 1.404795, 3.772344));
  EXPECT_EQ(o.position_m, Eigen::Vector3d(3.008632, 1.41593, 13.15864));
  EXPECT_EQ(o.angles.rz, -0.07224336);
  EXPECT_EQ(o.occupr, 0.3971491);
  EXPECT_EQ(o.orig_label, "Car");
  EXPECT_TRUE(o.moving);
  EXPECT_EQ(o.model, "Hatchback");
  EXPECT_EQ(o.color, "Black");
}

TEST(Vkitti1Text, ObjectColumnsGoByName) {
  std::string header = header_row;
  const std::string row =
      "0 1 Car 0 2 -1.5 722 186 866 281 1.6 1.4 3.7 3.0 1.4 13.1 -1.5 0.1 -0.2 0 0.4 Van 0 M C\n";
  const auto plain = decode_vkitti1_objects(header + row, "x")[0];
  const auto moved = decode_vkitti1_objects(fmt::format("extra {}9 {}", header, row),
                                            "x")[0];  // every column one further to the right
  EXPECT_EQ(encode_vkitti1_objects({plain}), encode_vkitti1_objects({moved}));
  EXPECT_EQ(encode_vkitti1_objects({plain}), header +
                                                 "0 1 Car 0 2 -1.5 722 186 866 281 1.6 1.4 3.7 "
                                                 "3 1.4 13.1 -1.5 0.1 -0.2 0 0.4 Van 0 M C\n");
}

TEST(Vkitti1Text, BadObjects) {
  const std::string row =
      "0 1 Car 0 2 -1.5 722 186 866 281 1.6 1.4 3.7 3.0 1.4 13.1 -1.5 0.1 -0.2 0 0.4 Car 0 M C\n";
  const auto error = [&](const std::string& text, const char* message) {
    expect_error([&] { decode_vkitti1_objects(text, "x.txt"); }, message);
  };
  std::string older = header_row;
  older.replace(older.find(" moving model color"), 19, "");
  error(older + row, "x.txt:1: the first row names no column moving, model, color: expected frame tid");
  error(header_row + row + row, "x.txt:3: track 1 appears twice in frame 0");
  error(header_row + row.substr(0, row.size() - 5), "x.txt:2: expected 25 values");
  const auto with = [&](const std::string& from, const std::string& to) {
    const size_t at = row.find(from);
    return header_row + row.substr(0, at) + to + row.substr(at + from.size());
  };
  error(with("13.1", "inf"), "x.txt:2: expected a finite number for z3d");
  error(with("0 M", "2 M"), "x.txt:2: expected 0, 1, True or False for moving, got '2'");
  error(header_row + fmt::format("0 -1{}", row.substr(3)), "x.txt:2: expected a track id >= 0, got -1");
}

TEST(Vkitti1Text, Colors) {
  const std::string text = "Category(:id) r g b\nBuilding 140 140 140\nCar:0 200 1 2\nVan:12 3 4 255\n";
  const auto colors = decode_vkitti1_colors(text, "x.txt");
  ASSERT_EQ(colors.size(), 3u);
  EXPECT_EQ(colors[0].category, "Building");
  EXPECT_FALSE(colors[0].tid.has_value());
  EXPECT_EQ(colors[2].category, "Van");
  EXPECT_EQ(colors[2].tid, 12);
  EXPECT_EQ(colors[2].color, (Rgb{3, 4, 255}));
  EXPECT_EQ(encode_vkitti1_colors(colors), text);
  const auto error = [&](const std::string& rows, const char* message) {
    expect_error([&] { decode_vkitti1_colors("Category(:id) r g b\n" + rows, "x.txt"); }, message);
  };
  error("Car:0 1 2 3\nCar:1 1 2 3\n", "x.txt:3: colour 1 2 3 is that of line 2 already");
  error("Car:0 1 2 256\n", "x.txt:2: expected a colour of 0 to 255, got 256");
  error("Car:x 1 2 3\n", "x.txt:2: expected a track id of 0 or more after ':', got 'Car:x'");
  error("Car:0 1 2\n", "x.txt:2: expected 4 values");
}

TEST(VkittiBox, AnglesAreTheInverseOfTheRotation) {
  for (const VkittiAngles& a : {VkittiAngles{1.638601, -0.01539355, 0.0373097}, VkittiAngles{-3.1, 0.3, -0.2},
                                VkittiAngles{0, 0, 0}}) {
    const VkittiAngles b = vkitti_angles(vkitti_rotation(a));
    EXPECT_NEAR(a.ry, b.ry, 1e-12);
    EXPECT_NEAR(a.rx, b.rx, 1e-12);
    EXPECT_NEAR(a.rz, b.rz, 1e-12);
  }
  // ry = 0 is heading along the camera's x axis.
  EXPECT_LT((vkitti_rotation({}) * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

}  // namespace

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
