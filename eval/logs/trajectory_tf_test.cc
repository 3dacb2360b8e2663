#include "sextant/eval/logs/trajectory_message.h"

#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/logs/recordings_testing.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {
namespace {

using namespace recordings;  // NOLINT: this file is written in their terms

// map -> odom (slow) -> base (fast) -> mount (static, rotated by 90 deg about z) -> camera (static); lidar
// next to it.
Sample at(uint32_t sec, uint32_t nsec, double x, double y = 0, double z = 0, double half_turn_z = 0) {
  return {sec, nsec, {x, y, z, 0, 0, std::sin(half_turn_z), std::cos(half_turn_z)}, {}};
}
const std::vector<std::vector<Transform>> moving = {
    {{"map", "odom", at(10, 0, 0)}},
    {{"odom", "base", at(10, 500'000'000, 1)}, {"odom", "base", at(11, 0, 2)}},
    {{"map", "odom", at(12, 0, 0, 4)}},
    {{"odom", "base", at(11, 500'000'000, 3)}, {"odom", "base", at(12, 500'000'000, 4)}}};
const std::vector<Transform> fixed = {{"base", "mount", at(0, 0, 0.5, 0, 1, M_PI / 4)},
                                      {"mount", "camera", at(0, 0, 0.1)},
                                      {"base", "lidar", at(0, 0, -0.2)}};

std::string recording(const std::string& format, const std::vector<std::vector<Transform>>& tf = moving,
                      const std::vector<Transform>& tf_static = fixed, const std::string& slash = "/") {
  const bool ros1 = format == "bag";
  Channel a{slash + "tf", ros1 ? "tf2_msgs/TFMessage" : "tf2_msgs/msg/TFMessage", {}}, b = a;
  b.topic += "_static";
  const auto message = [&](const std::vector<Transform>& t) {
    return ros1 ? ros1_transforms(t) : cdr_transforms(t);
  };
  for (const auto& t : tf) a.messages.push_back(message(t));
  if (!tf_static.empty()) b.messages = {message(tf_static), message(tf_static)};
  if (ros1) return bag_of({b, a}, "lz4");
  return format == "mcap" ? mcap_of({a, b}, "zstd") : rosbag2_of({a, b});
}

TrajectoryFile path_of(const std::string& frames, const std::string& format = "bag") {
  return decode_trajectory(recording(format), format, "/tf:" + frames);
}

TEST(TransformTree, ChainsThroughStaticTransformsInEveryContainer) {
  for (const char* format : {"bag", "mcap", "rosbag2"}) {
    SCOPED_TRACE(format);
    const TrajectoryFile camera = path_of("odom.camera", format);
    EXPECT_THAT(camera.poses.stamps_s, ElementsAre(10.5, 11, 11.5, 12.5));
    EXPECT_LT((camera.poses.positions_m[1] - Eigen::Vector3d(2.5, 0.1, 1)).norm(), 1e-12);
    EXPECT_NEAR(camera.poses.rotations[1](1, 0), 1, 1e-12) << "x of the camera points along y of odom";
    EXPECT_THAT(camera.warnings, IsEmpty());
    EXPECT_EQ(path_of("odom.base", format).poses.positions_m[3], Eigen::Vector3d(4, 0, 0));
  }
}

TEST(TransformTree, GoesUpAndDownTheTree) {
  const TrajectoryFile inverse = path_of("camera.odom");
  const TrajectoryFile forward = path_of("odom.camera");
  for (size_t i = 0; i < forward.poses.size(); ++i)
    EXPECT_LT((forward.poses.pose(i) * inverse.poses.pose(i)).log().norm(), 1e-12);
  EXPECT_THAT(error_of([] { path_of("lidar.camera"); }), HasSubstr("are static: there is no path"));
}

TEST(TransformTree, OtherMovingTransformsAreInterpolatedWithAWarning) {
  const TrajectoryFile base = path_of("map.base");
  EXPECT_THAT(base.poses.stamps_s, ElementsAre(10.5, 11, 11.5)) << "12.5 is after the last of map -> odom";
  EXPECT_LT((base.poses.positions_m[1] - Eigen::Vector3d(2, 2, 0)).norm(), 1e-12);
  EXPECT_THAT(base.warnings, testing::UnorderedElementsAre(HasSubstr("1 of 4 stamps lie outside"),
                                                           HasSubstr("interpolated over up to 2 s")));
}

TEST(TransformTree, NamesOfTopicsAndFramesWithAndWithoutSlash) {
  const std::string bag =
      recording("bag", {{{"/map", "/odom", at(1, 0, 1)}, {"/map", "/odom", at(2, 0, 2)}}}, {}, "");
  for (const char* topic : {"/tf:map.odom", "tf:/map./odom", "tf:map.odom"})
    EXPECT_EQ(decode_trajectory(bag, "bag", topic).poses.size(), 2U) << topic;
  const std::string dots = recording("bag", {{{"a.b", "c.d", at(1, 0, 1)}}}, {});
  EXPECT_EQ(decode_trajectory(dots, "bag", "/tf:a.b.c.d").poses.size(), 1U);
  TempFolder folder;
  const std::string path = folder.write("x.bag", bag);
  EXPECT_EQ(read_trajectory(path + ":/tf:map.odom").poses.size(), 2U);
}

std::string tree_error(const std::vector<std::vector<Transform>>& tf, const std::vector<Transform>& tf_static,
                       const std::string& frames) {
  return error_of([&] { decode_trajectory(recording("mcap", tf, tf_static), "mcap", "/tf:" + frames); });
}

TEST(TransformTree, MissingFramesAreNamed) {
  EXPECT_THAT(tree_error(moving, fixed, "map.gripper"),
              AllOf(HasSubstr("no frame 'gripper'"), HasSubstr("map.odom (2 transforms)"),
                    HasSubstr("mount.camera (static)")));
}

TEST(TransformTree, HostileTreesAreErrors) {
  EXPECT_THAT(
      tree_error({{{"a", "b", at(1, 0, 1)}, {"b", "c", at(1, 0, 1)}, {"c", "a", at(1, 0, 1)}}}, {}, "a.b"),
      HasSubstr("form a cycle: a in c in b in a"));
  EXPECT_THAT(tree_error({{{"a", "b", at(1, 0, 1)}, {"c", "b", at(1, 0, 1)}}}, {}, "a.b"),
              HasSubstr("the frame 'b' has the parent 'c' here and 'a' before"));
  EXPECT_THAT(tree_error({{{"a", "a", at(1, 0, 1)}}}, {}, "a.b"), HasSubstr("two different names"));
  EXPECT_THAT(tree_error({{{"a", "", at(1, 0, 1)}}}, {}, "a.b"), HasSubstr("two different names"));
  EXPECT_THAT(tree_error({{{"a", "b", at(1, 0, 1)}, {"c", "d", at(1, 0, 1)}}}, {}, "a.d"),
              AllOf(HasSubstr("'a' and 'd' are not connected"), HasSubstr("below 'c'")));
  EXPECT_THAT(tree_error({{{"a", "b", at(1, 0, 1)}}}, {{"a", "b", at(0, 0, 1)}}, "a.b"),
              HasSubstr("keep one"));
  EXPECT_THAT(tree_error({{{"a", "b", at(1, 0, 1)}}, {{"b", "c", at(5, 0, 1)}}}, {}, "a.c"),
              HasSubstr("have no time in common"));
  EXPECT_THAT(tree_error({{{"a", "b", at(1, 0, NAN)}}}, {}, "a.b"), HasSubstr("position"));
  EXPECT_THAT(tree_error(moving, fixed, "map"), HasSubstr("give the transform as PARENT.CHILD"));
  EXPECT_THAT(error_of([] { decode_trajectory(recording("mcap"), "mcap", "/tf"); }),
              HasSubstr("give the transform as PARENT.CHILD"));
  EXPECT_THAT(error_of([] { decode_trajectory(recording("mcap"), "mcap"); }),
              AllOf(HasSubstr("no topic with poses"), HasSubstr("give /tf:PARENT.CHILD")));
  const Channel odom{"/odom", "nav_msgs/Odometry", {ros1_message("nav_msgs/Odometry", samples[0])}};
  EXPECT_THAT(error_of([&] { decode_trajectory(bag_of({odom}), "bag", "/odom:a.b"); }),
              HasSubstr("has no frames to choose"));
}

TEST(TransformTree, ChangingStaticTransformsAreAWarning) {
  const Channel moves{"/tf", "tf2_msgs/TFMessage", {ros1_transforms({{"a", "b", at(1, 0, 1)}})}};
  const Channel fixes{
      "/tf_static",
      "tf2_msgs/TFMessage",
      {ros1_transforms({{"b", "c", at(0, 0, 1)}}), ros1_transforms({{"b", "c", at(0, 0, 3)}})}};
  const TrajectoryFile file = decode_trajectory(bag_of({moves, fixes}), "bag", "/tf:a.c");
  EXPECT_EQ(file.poses.positions_m[0], Eigen::Vector3d(4, 0, 0));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("static transforms change")));
}

}  // namespace
}  // namespace sextant
