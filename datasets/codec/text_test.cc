#include <random>

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

constexpr const char* identity = " 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";

TEST(TextRows, ToleratesLayout) {
  TextRows rows("\xef\xbb\xbf# head\r\n\r\n \t1  +2.5\t-3e2 \r\n7", "a.txt", ' ', '#');
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.line(), 3);
  ASSERT_EQ(rows.fields().size(), 3u);
  EXPECT_EQ(rows.integer(0, "id"), 1);
  EXPECT_EQ(rows.finite(1, "x"), 2.5);
  EXPECT_EQ(rows.integer(2, "y"), -300);
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.integer(0, "id"), 7);
  EXPECT_FALSE(rows.next());
}

TEST(TextRows, SplitsAtASeparator) {
  TextRows rows("1, 2,,x \n", "a.csv", ',');
  ASSERT_TRUE(rows.next());
  ASSERT_EQ(rows.fields().size(), 4u);
  EXPECT_EQ(rows.integer(1, ""), 2);
  EXPECT_EQ(rows.field(2), "");
  EXPECT_EQ(rows.field(3), "x");
}

TEST(TextRowsErrors, NameFileLineAndValue) {
  TextRows rows("1 x nan 1.5\n", "a.txt");
  rows.next();
  expect_error([&] { rows.expect(3, "three values"); }, "a.txt:1: expected three values, got 4");
  expect_error([&] { rows.number(1, "depth"); }, "a.txt:1: expected a number for depth, got 'x'");
  expect_error([&] { rows.finite(2, "depth"); }, "a.txt:1: expected a finite number for depth, got 'nan'");
  expect_error([&] { rows.integer(3, "id"); }, "a.txt:1: expected a whole number for id, got '1.5'");
  expect_error([&] { rows.number(9, "depth"); }, "a.txt:1: expected at least 10 values, got 4");
}

TEST(PoseText, RoundTrips) {
  std::mt19937 rng(5);
  std::normal_distribution<double> normal;
  std::map<int, SE3> poses;
  for (int k = 3; k < 20; ++k) {
    Vector6d xi;
    for (int i = 0; i < 6; ++i) xi[i] = normal(rng);
    poses[k] = SE3::exp(xi);
  }
  const std::map<int, SE3> back = decode_pose_text(encode_pose_text(poses), "p.txt");
  ASSERT_EQ(back.size(), poses.size());
  for (const auto& [frame, pose] : poses) {
    EXPECT_LT((back.at(frame).matrix() - pose.matrix()).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST(PoseTextErrors, NameFileAndLine) {
  const std::string good = std::string("0") + identity;
  const auto error = [&](const std::string& line, const char* message) {
    expect_error([&] { decode_pose_text(good + line, "pose_gt.txt"); }, message);
  };
  error("1 1 0 0 0 0 1 0 0 0 0 1 0 0 0\n", "pose_gt.txt:2: expected frame number + 16 values, got 15");
  error("1 1 0 0 nan 0 1 0 0 0 0 1 0 0 0 0 1\n",
        "pose_gt.txt:2: expected a finite number for a pose value, got 'nan'");
  error("1 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2\n", "pose_gt.txt:2: expected 0 0 0 1 as the last row");
  error("1 1.01 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n", "pose_gt.txt:2: expected a rotation in the pose");
  error("1 1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1\n", "reflection");
  error(good, "pose_gt.txt:2: frame 0 has a pose already");
  error("1.5" + std::string(identity),
        "pose_gt.txt:2: expected a whole number for the frame number, got '1.5'");
}

TEST(YamlCamera, RoundTrips) {
  const YamlCamera camera{{{721.5377, 721.5, 609.5593, 172.854}, 387.5744}, 10};
  const YamlCamera back = decode_yaml_camera(encode_yaml_camera(camera), "camera.yaml");
  EXPECT_EQ(back.camera.left.fx, 721.5377);
  EXPECT_EQ(back.camera.left.fy, 721.5);
  EXPECT_EQ(back.camera.left.cx, 609.5593);
  EXPECT_EQ(back.camera.left.cy, 172.854);
  EXPECT_EQ(back.camera.bf, 387.5744);
  EXPECT_EQ(back.rate_hz, 10);
}

TEST(YamlCamera, ReadsOrbSlamFilesWithCommentsAndOtherKeys) {
  const YamlCamera camera = decode_yaml_camera(
      "%YAML:1.0\n\n# Camera Parameters\nCamera.fx: 700\nCamera.fy: 701.5\nCamera.cx: 600.0\nCamera.cy: "
      "170.0\n"
      "Camera.k1: 0.0\nCamera.bf: 380.1\nORBextractor.nFeatures: 2500\n",
      "kitti.yaml");
  EXPECT_EQ(camera.camera.left.fx, 700);
  EXPECT_EQ(camera.rate_hz, 0);
  EXPECT_TRUE(camera.distortion.empty());
  EXPECT_FALSE(camera.depth_map_factor);
}

TEST(YamlCamera, ReadsDistortionAndDepthFactorForWarnings) {
  const YamlCamera camera =
      decode_yaml_camera(encode_yaml_camera({{{700, 700, 600, 170}, 380}, 10}) +
                             "Camera.k1: -0.35\nCamera.p1: 0\nCamera.k3: 1e-3\nDepthMapFactor: 5000.0\n",
                         "camera.yaml");
  EXPECT_THAT(camera.distortion,
              testing::ElementsAre(testing::Pair("Camera.k1", -0.35), testing::Pair("Camera.k3", 1e-3)));
  EXPECT_EQ(camera.depth_map_factor, 5000);
}

TEST(YamlCameraErrors, NameFileAndKeys) {
  const auto with_fx = [](const std::string& fx) {
    return "%YAML:1.0\n---\nCamera.fx: " + fx + "\nCamera.fy: 7\nCamera.cx: 1\nCamera.cy: 1\nCamera.bf: 1\n";
  };
  for (const char* beyond : {"4294967346", "8589934642", "88888888884.", "1e300", "1e-320", "0"})
    expect_error([&] { decode_yaml_camera(with_fx(beyond), "c.yaml"); }, "expected a positive number");
  EXPECT_EQ(decode_yaml_camera(with_fx("50"), "c.yaml").camera.left.fx, 50);
  for (const char* no_keys : {"%YAML:1.0\n---\n- 1\n", "%YAML:1.0\n--Camera.fy: 1\nCamera.fps: 10."})
    expect_error([&] { decode_yaml_camera(no_keys, "c.yaml"); }, "c.yaml: ");
  expect_error(
      [] { decode_yaml_camera("%YAML:1.0\n---\nCamera.fx: 700\nCamera.fy: 700\nCamera.cx: 1\n", "c.yaml"); },
      "c.yaml: missing Camera.cy, Camera.bf");
  expect_error(
      [] {
        decode_yaml_camera(
            "%YAML:1.0\n---\nCamera.fx: -7\nCamera.fy: 700\nCamera.cx: 1\nCamera.cy: 1\nCamera.bf: 300\n",
            "c.yaml");
      },
      "c.yaml: Camera.fx = -7: expected a positive number");
  expect_error([] { decode_yaml_camera("Camera.fx: 700\n", "c.yaml"); },
               "c.yaml: expected an OpenCV YAML file");
  expect_error([] { decode_yaml_camera("%YAML:1.0\n---\n\t{ ] broken\n", "c.yaml"); }, "c.yaml: ");
}

TEST(TextRows, BoxesWhoseEdgesAreExchangedAreRefused) {
  const auto box_of = [](std::string_view text) {
    TextRows rows(text, "x.txt");
    rows.next();
    return rows.box(0);
  };
  EXPECT_EQ(box_of("100 50 140 80"), (ImageBox{100, 50, 140, 80}));
  EXPECT_EQ(box_of("0 0 0 0"), (ImageBox{0, 0, 0, 0}));  // written in place of an unknown box
  expect_error(
      [&] { box_of("100 50 40 80"); },
      "x.txt:1: expected a box with left <= right and top <= bottom, got left 100, top 50, right 40, "
      "bottom 80: is it written as x, y, width, height?");
  expect_error([&] { box_of("100 50 140 30"); }, "x.txt:1: expected a box with left <= right");
}

TEST(TextRows, NumbersOutsideThePlausibleRangeAreRefused) {
  const auto first_of = [](std::string_view text) {
    TextRows rows(text, "x.txt");
    rows.next();
    return rows;
  };
  EXPECT_EQ(first_of("-1e7").metres(0, "x"), -1e7);
  expect_error([&] { first_of("1e300").metres(0, "x"); },
               "x.txt:1: expected metres between -1e7 and 1e7 for x, got '1e300'");
  expect_error([&] { first_of("nan").metres(0, "x"); }, "x.txt:1: expected a finite number for x");
  EXPECT_EQ(first_of("-10").radians(0, "ry"), -10);  // KITTI's regions of type DontCare
  expect_error(
      [&] { first_of("90").radians(0, "ry"); },
      "x.txt:1: expected radians between -4 pi and 4 pi for ry, got '90': convert degrees to radians");
  EXPECT_EQ(first_of("9999999").frame(0), 9999999);
  expect_error([&] { first_of("2147483647").frame(0); }, "expected a frame number of at most 9999999");
  expect_error([&] { first_of("-1").frame(0); }, "expected a frame number >= 0, got -1");
  EXPECT_EQ(first_of("65534").track(0), 65534);
  expect_error([&] { first_of("2147483647").track(0); }, "expected a track id of at most 65534");
}

}  // namespace
}  // namespace sextant
