#include "sextant/eval/diagnosis/motion_readings.h"

#include <gtest/gtest.h>

#include <random>

#include "sextant/eval/diagnosis/readings_testing.h"
#include "sextant/geometry/axes.h"

namespace sextant {
namespace {

/// Motions in the frame `declared`; the estimate has relative noise `noise` of each step.
MotionData data_of(const Scene& scene, MotionFrame declared, double noise, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  MotionData data{declared, {}, {}};
  for (const auto& [key, pose] : scene.L) {
    const ObjectFrame before = previous(key);
    if (!scene.L.contains(before)) continue;
    MotionSample s{key, {}, {}, scene.L.at(before), scene.C.at(key.second - 1), scene.C.at(key.second)};
    const SE3 body = scene.L.at(before).inverse() * pose;
    Vector6d xi;
    for (int i = 0; i < 6; ++i)
      xi[i] = noise * body.translation().norm() * normal(random) * (i < 3 ? 0.6 : 0.1);
    s.reference = *change_frame(body, MotionFrame::body, declared, s);
    s.given = *change_frame(body * SE3::exp(xi), MotionFrame::body, declared, s);
    data.logged[key] = s.given;
    data.samples.push_back(s);
  }
  return data;
}

using Plant = std::function<SE3(const SE3&, const MotionSample&)>;

void plant(MotionData& data, const Plant& change, int only = 0) {
  for (MotionSample& s : data.samples) {
    if (only != 0 && s.key.first != only) continue;
    s.given = change(s.given, s);
    data.logged[s.key] = s.given;
  }
}

std::map<std::string, Plant> plants(MotionFrame declared) {
  std::map<std::string, Plant> all;
  for (const MotionFrame frame : {MotionFrame::world, MotionFrame::body, MotionFrame::camera}) {
    if (frame != declared)
      all["frame_" + std::string(to_string(frame))] = [=](const SE3& m, const MotionSample& s) {
        return *change_frame(m, declared, frame, s);
      };
  }
  all["inverse"] = [](const SE3& m, const MotionSample&) { return m.inverse(); };
  all["centimetres"] = [](const SE3& m, const MotionSample&) {
    return SE3(m.rotation(), 100 * m.translation());
  };
  all["millimetres"] = [](const SE3& m, const MotionSample&) {
    return SE3(m.rotation(), 1000 * m.translation());
  };
  all["quaternion_w_first"] = [](const SE3& m, const MotionSample&) {
    const Eigen::Quaterniond& q = m.rotation();  // written w x y z, read as x y z w
    return SE3(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), m.translation());
  };
  const SE3 C(Eigen::Quaterniond(opencv_from_axes(Axes::flu)), Eigen::Vector3d::Zero());
  all["axes_flu"] = [C](const SE3& m, const MotionSample&) { return C.inverse() * m * C; };
  all["mirrored_z"] = [](const SE3& m, const MotionSample&) { return mirrored_z(m); };
  all["per_second"] = [](const SE3& m, const MotionSample&) { return SE3::exp(10 * m.log()); };
  if (declared == MotionFrame::world) {
    all["displacement"] = [](const SE3& m, const MotionSample& s) {
      const Eigen::Vector3d& p = s.T_world_object->translation();
      return SE3(m.rotation(), m.translation() - p + m.rotation() * p);
    };
  }
  return all;
}

class MotionPlants : public testing::TestWithParam<std::tuple<MotionFrame, double>> {};

TEST_P(MotionPlants, AreNamedInShortLogsOfSlowNoisyObjects) {
  const auto [declared, slow_m] = GetParam();
  for (const int n_frames : {6, 40}) {
    for (const auto& [code, change] : plants(declared)) {
      MotionData data = data_of(scene(3, n_frames, slow_m), declared, 0.05);
      ASSERT_TRUE(explain_motions(data).empty());
      plant(data, change);
      const auto found = explain_motions(data);
      ASSERT_FALSE(found.empty()) << code << ", " << n_frames << " frames";
      EXPECT_TRUE(found[0].explanation.allows(code)) << code << " is called " << found[0].text("log");
    }
  }
}

TEST_P(MotionPlants, OfOneObjectOfSeveralAreReportedOfItAlone) {
  const auto [declared, slow_m] = GetParam();
  for (const auto& [code, change] : plants(declared)) {
    MotionData data = data_of(scene(4, 20, slow_m), declared, 0.05);
    plant(data, change, 2);
    const auto found = explain_motions(data);
    ASSERT_EQ(found.size(), 1u) << code;
    EXPECT_TRUE(found[0].explanation.allows(code)) << code << " is called " << found[0].text("log");
    EXPECT_EQ(found[0].objects, std::vector<int>{2}) << code;
    EXPECT_FALSE(found[0].of_all);
  }
}

INSTANTIATE_TEST_SUITE_P(Diagnosis, MotionPlants,
                         testing::Combine(testing::Values(MotionFrame::world, MotionFrame::body),
                                          testing::Values(0.03, 0.8)));

/// Returns `right` with the estimates moved to other frame numbers by `lag`.
MotionData shifted(const MotionData& right, int lag) {
  MotionData data{right.declared, {}, {}};
  for (const auto& [key, motion] : right.logged) data.logged[{key.first, key.second + lag}] = motion;
  for (MotionSample s : right.samples) {
    const auto at = data.logged.find(s.key);
    if (at == data.logged.end()) continue;
    s.given = at->second;
    data.samples.push_back(s);
  }
  return data;
}

TEST(MotionReadings, ShiftedFramesAreNamedWithTheirShift) {
  const MotionData right = data_of(scene(3, 40, 0.8), MotionFrame::world, 0.05);
  for (const int lag : {-3, -1, 1, 2}) {
    const auto found = explain_motions(shifted(right, lag));
    ASSERT_FALSE(found.empty()) << lag;
    EXPECT_EQ(found[0].code(), fmt::format("lag_{}", lag));
  }
}

/// Returns `right` with the motions of the objects under other ids; a reference stays with its object.
MotionData with_ids(const MotionData& right, const std::map<int, int>& new_id) {
  MotionData data{right.declared, {}, {}, {}};
  for (const auto& [key, motion] : right.logged)
    data.logged[{new_id.contains(key.first) ? new_id.at(key.first) : key.first, key.second}] = motion;
  for (MotionSample s : right.samples) {
    const auto at = data.logged.find(s.key);
    if (at != data.logged.end()) s.given = at->second;
    (at != data.logged.end() ? data.samples : data.not_logged).push_back(s);
  }
  return data;
}

TEST(MotionReadings, ExchangedIdsAreNamedAndNotTakenForAnotherMistake) {
  for (const int n_frames : {10, 40}) {
    for (const MotionFrame declared : {MotionFrame::world, MotionFrame::body}) {
      const MotionData right = data_of(scene(3, n_frames, 0.8), declared, 0.05);
      for (const std::map<int, int>& new_id :
           {std::map<int, int>{{1, 2}, {2, 1}}, {{1, 2}, {2, 3}, {3, 1}}, {{1, 2}, {2, 3}, {3, 4}}}) {
        const auto found = explain_motions(with_ids(right, new_id));
        ASSERT_FALSE(found.empty());
        for (const ObjectExplanation& e : found) EXPECT_EQ(e.code(), "ids") << e.text("log");
        const std::string text = found[0].text("log");
        EXPECT_TRUE(text.find("object 1 are logged as object 2") != std::string::npos ||
                    text.find("the motions of object 1 as object 2") != std::string::npos)
            << text;
      }
      const auto off = explain_motions(with_ids(right, {{1, 2}, {2, 3}, {3, 4}}));
      EXPECT_NE(off[0].text("log").find("subtract 1 from each id"), std::string::npos) << off[0].text("log");
    }
  }
}

TEST(MotionReadings, IdsOfWhichNoneIsInTheTruthAreNamed) {
  for (const MotionFrame declared : {MotionFrame::world, MotionFrame::body, MotionFrame::camera}) {
    const auto one = explain_motions(with_ids(data_of(scene(1, 10, 0.8), declared, 0.05), {{1, 2}}));
    ASSERT_EQ(one.size(), 1U) << to_string(declared);
    EXPECT_EQ(one[0].code(), "ids");
    EXPECT_NE(one[0].text("log").find("object 1 are logged as object 2"), std::string::npos);
    const auto all =
        explain_motions(with_ids(data_of(scene(3, 10, 0.8), declared, 0.05), {{1, 101}, {2, 102}, {3, 103}}));
    ASSERT_EQ(all.size(), 1U) << to_string(declared);
    EXPECT_NE(all[0].text("log").find("subtract 100 from each id"), std::string::npos);
  }
}

TEST(MotionReadings, AnObjectThatResemblesAnotherOneIsNotTakenForIt) {
  // A lost estimate that repeats a resting object, and one that copies an object that is logged correctly.
  const MotionData right = data_of(scene(3, 40, 0.8), MotionFrame::world, 0.05);
  MotionData still = right, copied = right;
  plant(
      still, [](const SE3&, const MotionSample&) { return SE3(); }, 2);
  plant(
      copied,
      [&](const SE3&, const MotionSample& s) {
        return right.logged.at({1, s.key.second});
      },
      2);
  for (MotionSample& s : still.samples) {
    if (s.key.first == 3) s.reference = SE3();
  }
  for (const MotionData* data : {&still, &copied}) {
    for (const ObjectExplanation& e : explain_motions(*data)) EXPECT_NE(e.code(), "ids") << e.text("log");
  }
}

TEST(MotionReadings, MotionsOfNineStepsInTheBodyFrameAreNamedWithoutPosesOfObjects) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    MotionData data = data_of(scene(3, 10, 0.8), MotionFrame::world, 0.05, seed);
    plant(data, plants(MotionFrame::world).at("frame_body"));
    for (MotionSample& s : data.samples) s.T_world_object.reset();
    const auto found = explain_motions(data);
    ASSERT_FALSE(found.empty());
    for (const ObjectExplanation& e : found)
      EXPECT_EQ(e.code(), "frame_body") << e.text("log") << ", seed " << seed;
  }
}

/// An estimate of an object that rests, with errors of a millimetre.
SE3 nearly_at_rest(const SE3&, const MotionSample& s) {
  const double k = s.key.second;
  return about_y(1e-4 * std::sin(37 * k), {1e-3 * std::sin(53 * k), 0, 1e-3 * std::sin(71 * k)});
}

TEST(MotionReadings, AMovingObjectUnderTheIdOfARestingOneIsNamed) {
  MotionData data = data_of(scene(3, 20, 0.8), MotionFrame::world, 0.05);
  plant(data, nearly_at_rest, 2);
  for (MotionSample& s : data.samples) {
    if (s.key.first == 2) s.reference = SE3();
  }
  EXPECT_TRUE(explain_motions(data).empty());
  const auto found = explain_motions(with_ids(data, {{1, 2}, {2, 1}}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].code(), "ids") << found[0].text("log");
}

TEST(MotionReadings, AnEstimateThatRestsIsNotReadInAnotherFrame) {
  // The object follows the camera, so that a resting estimate would fit in camera coordinates, inverted.
  Scene follows = scene(2, 12, 0.8);
  for (auto& [key, L] : follows.L) L = follows.C.at(key.second) * about_y(0, {3.0 * key.first, 1, 12});
  MotionData data = data_of(follows, MotionFrame::world, 0.01);
  plant(data, nearly_at_rest);
  for (const ObjectExplanation& e : explain_motions(data)) ADD_FAILURE() << e.text("log");
}

TEST(MotionReadings, ExchangedObjectsAreNoShift) {
  const MotionData exchanged =
      with_ids(data_of(scene(3, 40, 0.8), MotionFrame::world, 0.05), {{1, 2}, {2, 3}, {3, 1}});
  EXPECT_FALSE(explain_hidden_shift(exchanged));
}

TEST(MotionReadings, ShiftedMotionsInCameraCoordinatesAreNamed) {
  // The camera brakes and turns, so that motions in camera coordinates change more than those in the world.
  for (const auto& [n_frames, lag] : {std::pair(10, -1), {10, 1}, {14, -1}, {14, 1}, {14, 2}}) {
    Scene of_camera = scene(3, n_frames, 0.3);
    for (auto& [k, C] : of_camera.C)
      C = about_y(0.3 + 0.02 * std::sin(0.9 * k), {4, 0, 2 + 0.9 * k + 0.4 * std::sin(0.8 * k)});
    const MotionData right = data_of(of_camera, MotionFrame::world, 0.05);
    MotionData in_camera = right;
    in_camera.logged.clear();
    std::map<ObjectFrame, SE3> X;
    for (const MotionSample& s : right.samples)
      X[{s.key.first, s.key.second + lag}] =
          *change_frame(s.given, MotionFrame::world, MotionFrame::camera, s);
    std::erase_if(in_camera.samples, [&](MotionSample& s) {
      const auto at = X.find(s.key);
      if (at == X.end()) return true;
      s.given = *change_frame(at->second, MotionFrame::camera, MotionFrame::world, s);
      in_camera.logged[s.key] = s.given;
      return false;
    });
    const auto found = explain_motions(in_camera);
    ASSERT_FALSE(found.empty()) << lag;
    EXPECT_EQ(found[0].code(), fmt::format("camera_lag_{}", lag)) << found[0].text("log");
  }
}

TEST(MotionReadings, ShiftsThatNoiseHidesAreNamedByTheChangeOfTheMotion) {
  // Errors of about a third of a step make the residuals of both readings nearly equal.
  int n_named = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const MotionData right = data_of(scene(3, 60, 0.8), MotionFrame::world, 0.35, seed);
    EXPECT_FALSE(explain_hidden_shift(right));
    for (const int lag : {-2, -1, 1, 3}) {
      const auto found = explain_motions(shifted(right, lag));
      if (found.empty()) continue;
      ++n_named;
      // The camera hardly turns, so that a shift in camera coordinates has the same correction and effect.
      EXPECT_TRUE(found[0].code().ends_with(fmt::format("lag_{}", lag)))
          << found[0].code() << ", seed " << seed;
    }
  }
  EXPECT_GE(n_named, 36) << "of 40";
}

TEST(MotionReadings, ShiftsBelowTheNoiseOfEstimatesOrTruthAreLeftOpen) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const MotionData right = data_of(scene(3, 60, 0.8), MotionFrame::world, 3, seed);
    for (const int lag : {-1, 0, 1})
      EXPECT_FALSE(explain_hidden_shift(shifted(right, lag))) << lag << ", seed " << seed;
    // A truth with independent noise in each frame, as labels made by hand have.
    MotionData labelled = data_of(scene(3, 60, 0.8), MotionFrame::world, 0.05, seed);
    const MotionData noise = data_of(scene(3, 60, 0.8), MotionFrame::world, 1, seed + 100);
    for (size_t i = 0; i < labelled.samples.size(); ++i)
      labelled.samples[i].reference = noise.samples[i].given;
    EXPECT_FALSE(explain_hidden_shift(labelled)) << seed;
  }
}

TEST(MotionReadings, MotionsInTheWorldAreNamedWithoutPosesOfObjects) {
  // At 30 m from the origin a rotation of one degree moves an object by half a metre.
  Scene far = scene(2, 60, 0.5);
  const SE3 away = about_y(0, {20, 0, 25});
  for (auto& [key, pose] : far.L) pose = away * pose;
  for (auto& [k, pose] : far.C) pose = away * pose;
  MotionData data = data_of(far, MotionFrame::body, 0.2);
  plant(data, [](const SE3& m, const MotionSample& s) {
    return *change_frame(m, MotionFrame::body, MotionFrame::world, s);
  });
  for (MotionSample& s : data.samples) s.T_world_object.reset();
  const auto found = explain_motions(data);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].code(), "frame_world") << found[0].text("log");
}

TEST(MotionReadings, OtherFramesAreNamedWithoutPosesOfObjects) {
  const auto without_poses = [](MotionData data) {
    for (MotionSample& s : data.samples) s.T_world_object.reset();
    return data;
  };
  const auto body = [](const SE3& m, const MotionSample& s) {
    return *change_frame(m, MotionFrame::world, MotionFrame::body, s);
  };
  const auto camera_axes = [](const SE3& m, const MotionSample& s) {
    const SE3 H = *change_frame(m, MotionFrame::body, MotionFrame::world, s);
    return s.T_world_prev->inverse() * H * *s.T_world_prev;
  };
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Scene seen = scene(2, 40, 0.5);
    MotionData in_body = data_of(seen, MotionFrame::world, 0.1, seed),
               in_axes = data_of(seen, MotionFrame::body, 0.1, seed);
    EXPECT_TRUE(explain_motions(without_poses(in_body)).empty()) << seed;
    EXPECT_TRUE(explain_motions(without_poses(in_axes)).empty()) << seed;
    plant(in_body, body);
    plant(in_axes, camera_axes);
    const auto of_body = explain_motions(without_poses(in_body)),
               of_axes = explain_motions(without_poses(in_axes));
    ASSERT_FALSE(of_body.empty()) << seed;
    EXPECT_EQ(of_body[0].code(), "frame_body") << of_body[0].text("log");
    ASSERT_FALSE(of_axes.empty()) << seed;
    EXPECT_TRUE(of_axes[0].explanation.allows("frame_camera_axes")) << of_axes[0].text("log");
  }
}

TEST(MotionReadings, ObjectsThatReverseInAllOfTheLogAreListed) {
  const MotionData data = data_of(scene(3, 30, 0.5), MotionFrame::body, 0.05);
  const std::vector<Eigen::Vector3d> forward = {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()};
  EXPECT_TRUE(bodies_that_reverse(data.logged, forward).empty());
  std::map<ObjectFrame, SE3> inverse;
  for (const auto& [key, motion] : data.logged) inverse[key] = motion.inverse();
  EXPECT_EQ(bodies_that_reverse(inverse, forward), (std::vector<int>{1, 2, 3}));
  for (auto& [key, motion] : inverse) {
    if (key.first == 2) motion = motion.inverse();
  }
  EXPECT_TRUE(bodies_that_reverse(inverse, forward).empty());
}

TEST(MotionReadings, VelocitiesAreNamedWithTheirFactor) {
  MotionData data = data_of(scene(3, 30, 0.8), MotionFrame::body, 0.05);
  plant(data, [](const SE3& m, const MotionSample&) { return SE3(m.rotation(), 25 * m.translation()); });
  const auto found = explain_motions(data);
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found[0].explanation.allows("velocity"));
  EXPECT_NE(found[0].text("log").find("look like velocities, 24.9 times the motion of one"),
            std::string::npos)
      << found[0].text("log");
}

TEST(MotionReadings, MotionsInTheWorldOfAnotherCameraAreNamed) {
  const SE3 W = about_y(0.35, {10, 0, 5});
  for (const double noise : {0.05, 0.3}) {
    MotionData data = data_of(scene(3, 30, 0.8), MotionFrame::world, noise);
    data.T_true_estimated = W;
    EXPECT_TRUE(explain_motions(data).empty()) << "the motions are in the world of the truth";
    plant(data, [&](const SE3& m, const MotionSample&) { return W.inverse() * m * W; });
    const auto found = explain_motions(data);
    ASSERT_FALSE(found.empty()) << noise;
    EXPECT_EQ(found[0].code(), "other_world") << found[0].text("log");
    EXPECT_EQ(found[0].of_all, noise < 0.1);
  }
}

TEST(MotionReadings, AbsoluteMotionsAreNamed) {
  const Scene all = scene(2, 20, 0.8);
  MotionData data = data_of(all, MotionFrame::world, 0.05);
  for (MotionSample& s : data.samples) data.logged[s.key] = s.given = all.L.at(s.key);
  const auto found = explain_motions(data);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].code(), "absolute");
}

TEST(MotionReadings, MotionsOverTwoFramesAreNamed) {
  for (const MotionFrame declared : {MotionFrame::world, MotionFrame::body, MotionFrame::camera}) {
    MotionData data = data_of(scene(3, 20, 0.8), declared, 0.05);
    const auto logged = data.logged;
    for (MotionSample& s : data.samples) {
      const auto before = find_pose(logged, previous(s.key));
      if (!before) continue;  // the first motion stays
      // In the world and in camera coordinates the later motion acts last, in the body frame first.
      s.given = declared == MotionFrame::body ? *before * s.given : s.given * *before;
      data.logged[s.key] = s.given;
    }
    const auto found = explain_motions(data);
    ASSERT_FALSE(found.empty()) << to_string(declared);
    EXPECT_EQ(found[0].code(), "two_frames") << found[0].text("log");
  }
}

TEST(MotionReadings, TransposedRotationsAreNamedWhereErrorsOfTranslationsAreLarger) {
  MotionData data = data_of(scene(2, 40, 0.8), MotionFrame::body, 0);
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 0.05);
  for (MotionSample& s : data.samples)
    s.given = SE3(s.given.rotation(),
                  s.given.translation() + Eigen::Vector3d(normal(random), normal(random), normal(random)));
  EXPECT_TRUE(explain_motions(data).empty());
  plant(data,
        [](const SE3& m, const MotionSample&) { return SE3(m.rotation().conjugate(), m.translation()); });
  const auto found = explain_motions(data);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].code(), "transposed");
}

TEST(MotionReadings, NoiseAloneIsNotExplained) {
  int n = 0, alarms = 0;
  for (const MotionFrame declared : {MotionFrame::world, MotionFrame::body, MotionFrame::camera}) {
    for (const double noise : {0.0, 0.05, 0.5, 2.0, 10.0}) {
      for (unsigned seed = 0; seed < 40; ++seed, ++n)
        alarms += explain_motions(data_of(scene(3, 8, 0.1), declared, noise, seed)).empty() ? 0 : 1;
    }
  }
  EXPECT_EQ(alarms, 0) << "of " << n;
}

TEST(MotionReadings, QuaternionsInAnotherOrderShowWithoutTruth) {
  MotionData data = data_of(scene(2, 8, 0.3), MotionFrame::world, 0.05);
  EXPECT_FALSE(explain_rotations(data.logged));
  plant(data, plants(MotionFrame::world).at("quaternion_w_first"));
  const auto found = explain_rotations(data.logged);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->best.code, "quaternion_w_first");
}

}  // namespace
}  // namespace sextant
