#include "sextant/eval/diagnosis/pose_readings.h"

#include <gtest/gtest.h>

#include <random>

#include "sextant/eval/diagnosis/readings_testing.h"
#include "sextant/geometry/axes.h"

namespace sextant {
namespace {

using PosePlant = std::function<SE3(const SE3&, int)>;

TEST(PoseReadings, PlantsInPosesOfCamerasAndObjectsAreNamed) {
  const Scene truth = scene(2, 20, 0.5);
  const auto in_axes = [](Axes axes) -> PosePlant {
    const SE3 C(Eigen::Quaterniond(opencv_from_axes(axes)), Eigen::Vector3d::Zero());
    return [C](const SE3& p, int) { return C.inverse() * p * C; };
  };
  const std::map<std::string, PosePlant> plants = {
      {"inverse", [](const SE3& p, int) { return p.inverse(); }},
      {"centimetres", [](const SE3& p, int) { return SE3(p.rotation(), 100 * p.translation()); }},
      {"transposed", [](const SE3& p, int) { return SE3(p.rotation().conjugate(), p.translation()); }},
      {"scale", [](const SE3& p, int) { return SE3(p.rotation(), 0.3 * p.translation()); }},
      {"axes_opengl", in_axes(Axes::opengl)},
      {"axes_ned", in_axes(Axes::ned)},
      {"axes_flu", in_axes(Axes::flu)},
      {"mirrored_z", [](const SE3& p, int) { return mirrored_z(p); }},
      {"quaternion_w_first",
       [](const SE3& p, int) {
         const Eigen::Quaterniond& q = p.rotation();
         return SE3(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), p.translation());
       }},
      {"frame_camera", [&](const SE3& p, int k) { return truth.C.at(k).inverse() * p; }},
  };
  for (const SharedFrame shared : {SharedFrame::body, SharedFrame::world}) {
    PoseData right{shared, {}, {}, {}};
    if (shared == SharedFrame::world) {
      right.reference = truth.L;
      right.T_world_camera = truth.C;
    } else {
      for (const auto& [k, pose] : truth.C) right.reference[{0, k}] = pose;
    }
    right.given = right.reference;
    for (auto& [key, pose] : right.given)  // 1 cm
      pose = pose *
             SE3(Eigen::Quaterniond::Identity(), 0.01 * Eigen::Vector3d(std::sin(17.0 * key.second), 0, 0));
    EXPECT_TRUE(explain_poses(right).empty());
    for (const auto& [code, change] : plants) {
      if (code == "frame_camera" && shared == SharedFrame::body) continue;
      if (code == "scale" && shared == SharedFrame::world) continue;
      PoseData data = right;
      for (auto& [key, pose] : data.given) pose = change(pose, key.second);
      const auto found = explain_poses(data);
      ASSERT_FALSE(found.empty()) << code;
      EXPECT_TRUE(found[0].explanation.allows(code)) << code << " is called " << found[0].text("log");
    }
    PoseData steps = right;
    for (auto& [key, pose] : steps.given) {
      const auto before = right.given.find({key.first, key.second - 1});
      if (before == right.given.end()) continue;
      pose = shared == SharedFrame::body ? before->second.inverse() * right.given.at(key)
                                         : right.given.at(key) * before->second.inverse();
    }
    const auto found = explain_poses(steps);
    ASSERT_FALSE(found.empty());
    EXPECT_TRUE(found[0].explanation.allows("per_step")) << found[0].text("log");
    PoseData inverse = right;
    for (auto& [key, pose] : inverse.given) {
      const auto before = right.given.find(previous(key));
      if (before == right.given.end()) continue;
      const SE3 &g0 = before->second, &g1 = right.given.at(key), &chained = inverse.given.at(previous(key));
      pose = shared == SharedFrame::body ? chained * (g1.inverse() * g0) : g0 * g1.inverse() * chained;
    }
    const auto inverted = explain_poses(inverse);
    ASSERT_FALSE(inverted.empty());
    EXPECT_TRUE(inverted[0].explanation.allows("inverse_steps")) << inverted[0].text("log");
    if (shared == SharedFrame::world) {
      PoseData moved = right;
      moved.T_true_estimated = about_y(0.35, {10, 0, 5});
      EXPECT_TRUE(explain_poses(moved).empty());
      for (auto& [key, pose] : moved.given) pose = moved.T_true_estimated->inverse() * pose;
      const auto other_world = explain_poses(moved);
      ASSERT_FALSE(other_world.empty());
      EXPECT_EQ(other_world[0].code(), "other_world") << other_world[0].text("log");
    }
    PoseData renumbered = right;  // every second frame
    renumbered.given.clear();
    for (const auto& [key, pose] : right.given) {
      if (key.second % 2 == 0) renumbered.given[{key.first, key.second / 2}] = pose;
    }
    const auto spread = explain_poses(renumbered);
    ASSERT_FALSE(spread.empty());
    EXPECT_EQ(spread[0].code(), "every_2") << spread[0].text("log");
  }
}

TEST(PoseReadings, NoOrderOfQuaternionsExplainsMatrices) {
  PoseData data{SharedFrame::body, {}, {}, {}};
  for (const auto& [k, pose] : scene(1, 20, 0.5).C) {
    const Eigen::Quaterniond& q = pose.rotation();
    data.reference[{0, k}] = pose;
    data.given[{0, k}] = SE3(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), pose.translation());
  }
  ASSERT_FALSE(explain_poses(data).empty());
  EXPECT_TRUE(explain_poses(data)[0].explanation.allows("quaternion_w_first"));
  data.quaternions = false;
  for (const ObjectExplanation& found : explain_poses(data)) {
    EXPECT_FALSE(found.explanation.allows("quaternion_w_first"));
    EXPECT_FALSE(found.explanation.allows("quaternion_w_last"));
  }
}

TEST(PoseReadings, ACameraThatRepeatsItsPoseWhileTheTruthMovesIsCounted) {
  PoseData data{SharedFrame::body, {}, {}, {}};
  for (const auto& [k, pose] : scene(1, 20, 0.5).C) data.given[{0, k}] = data.reference[{0, k}] = pose;
  EXPECT_TRUE(repeated_camera_poses(data).frames.empty());
  data.given[{0, 7}] = data.given[{0, 8}] = data.given[{0, 6}];
  data.reference[{0, 15}] = data.given[{0, 15}] = data.given[{0, 14}];  // the true camera stands
  const RepeatedCameraPoses repeated = repeated_camera_poses(data);
  EXPECT_EQ(repeated.n_steps, 19);
  EXPECT_EQ(repeated.frames, (std::vector<int>{7, 8}));
  EXPECT_NE(repeated.text().find("in 2 of 19 steps while the true camera moves, first at frame 7"),
            std::string::npos);
}

TEST(PoseReadings, AShiftOfACameraThatDriftsShowsInTheChangesOfItsSteps) {
  const Scene truth = scene(1, 80, 0.5);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const int lag : {-3, -1, 0, 1, 2}) {
    PoseData data{SharedFrame::body, {}, {}, {}};
    SE3 drifting;
    for (const auto& [k, pose] : truth.C) {
      data.reference[{0, k}] = pose;
      Vector6d xi;
      for (int i = 0; i < 6; ++i) xi[i] = normal(random) * (i < 3 ? 0.03 : 0.001);
      if (k > 0) drifting = drifting * truth.C.at(k - 1).inverse() * pose * SE3::exp(xi);
      data.given[{0, k + lag}] = drifting;
    }
    const auto found = explain_poses(data);
    ASSERT_EQ(found.size(), lag == 0 ? 0u : 1u) << lag;
    if (lag == 0) continue;
    EXPECT_EQ(found[0].code(), fmt::format("lag_{}", lag));
  }
}

}  // namespace
}  // namespace sextant
