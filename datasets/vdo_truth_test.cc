#include "sextant/datasets/vdo_truth.h"

#include "sextant/base/testing.h"

namespace sextant {
namespace {

TEST(VdoObjects, ReadsBoxPoseAndOrder) {
  const ObjectTruths objects = decode_vdo_objects(
      "0\t3\t2.9e+02\t177\t331.5\t197\t-21.4\t1.7\t51.9\t0\n"
      "0\t1\t894.7\t190.6\t1241\t374\t3.4\t1.5\t4.7\t-1.5707963267948966\n",
      "object_pose.txt");
  ASSERT_EQ(objects.at(0).size(), 2u);
  const ObjectTruth& first = objects.at(0)[0];
  EXPECT_EQ(first.id, 1);
  EXPECT_EQ(first.box, (ImageBox{894.7, 190.6, 1241, 374}));
  EXPECT_FALSE(first.moving.has_value());
  // ry = -pi/2 drives ahead: the camera's axes.
  EXPECT_LT(rotation_angle_rad(first.T_camera_object.rotation()), 1e-12);
  EXPECT_EQ(first.T_camera_object.translation(), Eigen::Vector3d(3.4, 1.5, 4.7));
  // ry = 0 drives to the right: its z axis is the camera's x axis.
  const Eigen::Vector3d ahead = objects.at(0)[1].T_camera_object.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_LT((ahead - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

TEST(VdoObjects, EqualStepsAreInterpolated) {
  const ObjectTruths objects = decode_vdo_objects(
      "0 1 0 0 9 9 3.407977 1.5 10 0\n1 1 0 0 9 9 3.388173 1.5 11 0\n2 1 0 0 9 9 3.368369 1.5 12 0\n"
      "3 1 0 0 9 9 3.348566 1.5 13 0\n4 1 0 0 9 9 3.348566 1.5 14.1 0\n6 1 0 0 9 9 3.3 1.5 16 0\n",
      "");
  const std::vector<std::pair<int, bool>> expected = {{0, false}, {1, true},  {2, true},
                                                      {3, false}, {4, false}, {6, false}};
  for (const auto& [frame, interpolated] : expected)
    EXPECT_EQ(objects.at(frame)[0].interpolated, interpolated) << frame;
}

TEST(VdoObjectsErrors, NameFileAndLine) {
  const auto error = [](const char* text, const char* message) {
    expect_error([&] { decode_vdo_objects(text, "object_pose.txt"); }, message);
  };
  error("0 1 0 0 9 9 1 2 3\n",
        "object_pose.txt:1: expected frame id left top right bottom x y z ry (10 values), got 9");
  error("0 1 0 0 9 9 1 2 nan 0\n", "object_pose.txt:1: expected a finite number for z, got 'nan'");
  error("0 0 0 0 9 9 1 2 3 0\n", "object_pose.txt:1: expected an object id of 1 or more");
  error("0 1 0 0 9 9 1 2 3 0\n0 1 0 0 9 9 1 2 3 0\n", "object_pose.txt:2: object 1 appears twice in frame 0");
}

}  // namespace
}  // namespace sextant
