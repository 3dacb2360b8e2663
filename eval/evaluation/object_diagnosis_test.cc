// Plants mistakes in users' logs. A mistake must be refused or named, never scored silently.

#include "sextant/eval/evaluation/object_evaluation.h"

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/object_drive_testing.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {
namespace {

using Plant = std::function<SE3(const SE3& H_world, const SE3& L_prev, int k)>;
using CameraPlant = std::function<SE3(const SE3&)>;

const Plant as_is = [](const SE3& H, const SE3&, int) { return H; };

std::string row(const SE3& T, bool transposed = false) {
  std::string text;
  for (int i = 0; i < 16; ++i)
    text += fmt::format(" {:.12g}", transposed ? T.matrix()(i % 4, i / 4) : T.matrix()(i / 4, i % 4));
  return text;
}

/// The mistakes planted in each part of a log.
struct Plants {
  Plant estimate = as_is, truth = as_is;
  CameraPlant camera = [](const SE3& C) { return C; };
  std::function<bool(int)> keep = [](int) { return true; };
  int shift = 0;  ///< frames by which the estimates are shifted against the truth
  bool with_poses = true;
  bool transposed = false;
};

class ObjectDiagnosis : public testing::TestWithParam<LogFormat> {
 protected:
  ObjectScores evaluate(const Drive& drive, const Plants& plants) {
    const bool vdo = GetParam() == LogFormat::vdo;
    std::string motions, truth, poses, cameras, true_cameras;
    for (const auto& [key, unused] : drive.estimate) {
      const auto [id, k] = key;
      const auto estimated = drive.estimate.find({id, k - plants.shift});
      if (!plants.keep(k) || estimated == drive.estimate.end()) continue;
      const SE3& L = drive.L.at({id, k - 1});
      const auto declared = [&](const SE3& H) { return vdo ? body_motion(H, L) : H; };
      const SE3 e = declared(plants.estimate(estimated->second, L, k)),
                t = declared(plants.truth(drive.truth(key), L, k));
      if (vdo) {
        motions += fmt::format("{} {}{}\n", k, id, row(e, plants.transposed));
        truth += fmt::format("{} {}{}\n", k, id, row(t));
      } else {
        motions += fmt::format("{},{},{},{}\n", k, id, csv(e), csv(t));
      }
    }
    for (const auto& [key, L] : drive.L) {
      if (plants.with_poses && !vdo)
        poses += fmt::format("{},{},{},{}\n", key.second, key.first, csv(L), csv(L));
    }
    for (const auto& [k, C] : drive.camera.poses()) {
      cameras += vdo ? fmt::format("{}{}\n", k, row(plants.camera(C)))
                     : fmt::format("{},{},{}\n", k, csv(plants.camera(C)), csv(C));
      true_cameras += fmt::format("{}{}\n", k, row(C));
    }
    if (vdo) {
      folder_.write("obj_mot_rgbd_new.txt", motions);
      folder_.write("obj_mot_gt.txt", truth);
      folder_.write("initial_rgbd_new.txt", cameras);
      folder_.write("cam_pose_gt_rgbd_new.txt", true_cameras);
    } else {
      folder_.write("m_object_motion_log.csv", motions);
      if (!poses.empty()) folder_.write("m_object_pose_log.csv", poses);
      folder_.write("m_camera_pose_log.csv", cameras);
    }
    ObjectFiles files;
    files.folders = {folder_.path()};
    files.format = GetParam();
    return evaluate_object_files(files);
  }

  void expect_named(const ObjectScores& scores, const std::string& code) {
    ASSERT_EQ(scores.diagnoses.size(), 1u) << fmt::format("{}", fmt::join(scores.warnings, "\n"));
    EXPECT_EQ(scores.diagnoses[0].code, code) << scores.diagnoses[0].text;
  }
  void expect_error(const Drive& drive, const Plants& plants, const std::string& text) {
    try {
      evaluate(drive, plants);
      FAIL() << "expected an Error with: " << text;
    } catch (const Error& error) {
      EXPECT_THAT(std::string(error.what()), HasSubstr(text));
    }
  }

  TempFolder folder_;
};

/// Scales translations by `factor`, in the format's frame.
Plant scaled(LogFormat format, double factor) {
  return [=](const SE3& H, const SE3& L, int) {
    if (format != LogFormat::vdo) return SE3(H.rotation(), factor * H.translation());
    const SE3 body = body_motion(H, L);
    return L * SE3(body.rotation(), factor * body.translation()) * L.inverse();
  };
}

TEST_P(ObjectDiagnosis, RightLogsAreReadAsTheyAre) {
  for (const double slow : {1.0, 0.05}) {
    const ObjectScores scores = evaluate(Drive(slow), {});
    EXPECT_TRUE(scores.diagnoses.empty()) << scores.diagnoses[0].text;
    EXPECT_EQ(scores.rate_text(), "Frame rate: 10 Hz (default, --rate changes it)");
  }
}

TEST_P(ObjectDiagnosis, InverseEstimatesAreNamed) {
  for (const double slow : {1.0, 0.05})
    expect_named(
        evaluate(Drive(slow), {.estimate = [](const SE3& H, const SE3&, int) { return H.inverse(); }}),
        "inverse");
}

TEST_P(ObjectDiagnosis, TranslationsWithoutRotationsAreNamed) {
  const auto without_rotation = [](const SE3& motion) {
    return SE3(Eigen::Quaterniond::Identity(), motion.translation());
  };
  const bool vdo = GetParam() == LogFormat::vdo;
  const ObjectScores scores =
      evaluate(Drive(), {.estimate = [=](const SE3& H, const SE3& L, int) {
                 return vdo ? L * without_rotation(body_motion(H, L)) * L.inverse() : without_rotation(H);
               }});
  expect_named(scores, "no_rotations");
  EXPECT_THAT(scores.diagnoses[0].text,
              HasSubstr("none of the 58 motions turns, but the true ones turn by up to 1.1 deg"));
}

TEST_P(ObjectDiagnosis, EstimatesInAnotherFrameAreNamed) {
  const Drive drive;
  if (GetParam() == LogFormat::vdo) {
    expect_named(
        evaluate(drive, {.estimate = [](const SE3& H, const SE3& L, int) { return L * H * L.inverse(); }}),
        "frame_world");
  } else {
    expect_named(
        evaluate(drive, {.estimate = [](const SE3& H, const SE3& L, int) { return body_motion(H, L); }}),
        "frame_body");
    expect_named(evaluate(drive, {.estimate =
                                      [&](const SE3& H, const SE3&, int k) {
                                        return drive.camera.pose(k)->inverse() * H *
                                               *drive.camera.pose(k - 1);
                                      }}),
                 "frame_camera");
  }
}

/// Motions of a format with a file per object, whose truth is in the world frame.
TEST(ObjectFrames, OfEstimatesAloneAreNotCorrectedByAFlagForBoth) {
  const Drive drive;
  TempFolder folder;
  const auto write = [&](const std::string& name, const auto& motion) {
    std::map<int, std::string> text;
    for (const auto& [key, unused] : drive.estimate)
      text[key.first] += fmt::format("{}{}\n", key.second, row(motion(key)));
    for (const auto& [id, lines] : text) folder.write(fmt::format("obj_{}_motion{}.txt", id, name), lines);
  };
  std::string cameras;
  for (const auto& [k, C] : drive.camera.poses()) cameras += fmt::format("{}{}\n", k, row(C));
  folder.write("camera.txt", cameras);
  folder.write("camera_gt.txt", cameras);
  write("_gt", [&](ObjectFrame key) { return drive.truth(key); });
  const auto scores = [&](const std::optional<MotionFrame>& frame) {
    ObjectFiles files;
    files.folders = {folder.path()};
    files.format = LogFormat::motions;
    files.frame = frame;
    return evaluate_object_files(files);
  };
  const auto text = [&](const std::optional<MotionFrame>& frame) {
    const ObjectScores found = scores(frame);
    return found.diagnoses.empty() ? std::string() : found.diagnoses.front().text;
  };
  write("", [&](ObjectFrame key) {
    return drive.camera.pose(key.second)->inverse() * drive.estimate.at(key) *
           *drive.camera.pose(key.second - 1);
  });
  EXPECT_THAT(text(std::nullopt),
              AllOf(HasSubstr("look like those in the camera frame"),
                    HasSubstr("convert the estimates to the world frame"), Not(HasSubstr("give --frame"))));
  EXPECT_THAT(text(MotionFrame::camera),
              AllOf(HasSubstr("two frames, the world and the camera"), HasSubstr("leave --frame out"),
                    Not(HasSubstr("give --frame"))));
  EXPECT_THAT(scores(MotionFrame::camera).frame_text(), HasSubstr("Frame of the motions"));
  EXPECT_THAT(scores(MotionFrame::camera).frame_text(), HasSubstr(": camera, which nothing"));
  write("", [&](ObjectFrame key) { return body_motion(drive.estimate.at(key), drive.L.at(previous(key))); });
  EXPECT_THAT(text(std::nullopt),
              AllOf(HasSubstr("look like those in the object's own (body) frame"),
                    HasSubstr("convert the estimates to the world frame"), Not(HasSubstr("give --frame"))));
  EXPECT_THAT(text(MotionFrame::body),
              AnyOf(std::string(), AllOf(HasSubstr("two frames"), Not(HasSubstr("give --frame")))));
}

TEST_P(ObjectDiagnosis, TruthAndEstimateInAnotherFrameContradictThePoses) {
  if (GetParam() == LogFormat::vdo) GTEST_SKIP() << "logs of format vdo hold no poses of objects";
  const Plant body = [](const SE3& H, const SE3& L, int) { return body_motion(H, L); };
  const ObjectScores scores = evaluate(Drive(), {.estimate = body, .truth = body});
  expect_named(scores, "frame_body");
  EXPECT_THAT(scores.warnings[0], HasSubstr("true motions against the true poses"));
  EXPECT_THAT(scores.warnings[0], HasSubstr("--frame body"));
}

TEST_P(ObjectDiagnosis, CentimetresOfTheEstimateAreNamed) {
  const ObjectScores scores = evaluate(Drive(0.1), {.estimate = scaled(GetParam(), 100)});
  ASSERT_FALSE(scores.diagnoses.empty());
  EXPECT_THAT(scores.diagnoses[0].text, HasSubstr("centimetres"));
}

TEST_P(ObjectDiagnosis, AbsurdTruthIsAnErrorThatNamesTheLine) {
  expect_error(Drive(), {.estimate = scaled(GetParam(), 100), .truth = scaled(GetParam(), 100)},
               "the true speed of object 1 at frame ");
  expect_error(Drive(), {.truth = scaled(GetParam(), 1000)},
               GetParam() == LogFormat::vdo ? "obj_mot_gt.txt:" : "motion_log.csv:");
}

TEST_P(ObjectDiagnosis, ShiftedEstimatesAreNamed) {
  for (const int shift : {1, 2, 3})
    expect_named(evaluate(Drive(), {.shift = shift}), fmt::format("lag_{}", shift));
}

TEST_P(ObjectDiagnosis, AnInvertedCameraIsNamed) {
  expect_named(evaluate(Drive(), {.camera = [](const SE3& C) { return C.inverse(); }}), "inverse");
}

TEST_P(ObjectDiagnosis, MotionsThatAreInverseInTruthAndEstimateAreNamedOrDriveBackwards) {
  const Plant inverse = [](const SE3& H, const SE3&, int) { return H.inverse(); };
  expect_named(evaluate(Drive(), {.estimate = inverse, .truth = inverse}),
               GetParam() == LogFormat::vdo ? "backwards" : "inverse");
}

TEST_P(ObjectDiagnosis, EveryColumnOfTheTableHasANumber) {
  if (GetParam() == LogFormat::vdo) GTEST_SKIP() << "logs of format vdo hold no poses of objects";
  const ObjectScores scores = evaluate(Drive(), {});
  const Json rows = rows_to_json(object_table(scores.records, {&find_preset("paper"), 1}));
  for (const MetricDefinition* metric : metrics_for(in_summary)) {
    if (metric->body == "ego" || metric->unit == "px") continue;  // logs hold no flow
    EXPECT_TRUE(rows[0].contains(metric->name))
        << metric->name
        << ": no record of a log has it: compute it in eval/evaluation/object_evaluation.cc too";
  }
}

TEST_P(ObjectDiagnosis, MissingFramesCountAndAreListed) {
  const ObjectScores scores =
      evaluate(Drive(), {.keep = [](int k) { return k < 20 || k > 24; }, .with_poses = false});
  EXPECT_TRUE(scores.diagnoses.empty());
  EXPECT_THAT(scores.warnings, Contains(HasSubstr("object 4: 5 of 29 steps have no estimate, frames 20-24")));
  const Json rows = rows_to_json(object_table(scores.records, {&find_preset("vdo_slam"), 1}));
  EXPECT_NEAR(rows[0]["coverage_percent"], 100.0 * 24 / 29, 1e-9);
}

TEST_P(ObjectDiagnosis, IdentitiesOfAMovingObjectAreListed) {
  const Plants plants{.estimate = [](const SE3& H, const SE3&, int k) { return k > 26 ? SE3() : H; }};
  const ObjectScores scores = evaluate(Drive(), plants);
  EXPECT_THAT(scores.warnings,
              Contains(HasSubstr("object 1: 3 estimates are exactly the identity while the object "
                                 "moves, frames 27-29")));
  EXPECT_THAT(scores.warnings, Contains(HasSubstr("--identity lost")));
}

TEST_P(ObjectDiagnosis, IdentitiesAtTheEndAreNotTakenForAnotherMistake) {
  Plants plants;
  plants.estimate = [](const SE3& H, const SE3&, int k) { return k < Drive::n_frames - 6 ? H : SE3(); };
  const ObjectScores scores = evaluate(Drive(), plants);
  EXPECT_TRUE(scores.diagnoses.empty()) << fmt::format("{}", fmt::join(scores.warnings, "\n"));
  EXPECT_THAT(fmt::format("{}", fmt::join(scores.warnings, "\n")), HasSubstr("frames 24-29"));
}

TEST_P(ObjectDiagnosis, AShiftIsNamedInAShortLog) {
  Plants plants;
  plants.keep = [](int k) { return k < 16; };
  EXPECT_TRUE(evaluate(Drive(), plants).diagnoses.empty());
  plants.shift = 1;
  expect_named(evaluate(Drive(), plants), "lag_1");
}

TEST_P(ObjectDiagnosis, StructuralFaultsAreErrors) {
  if (GetParam() == LogFormat::vdo) expect_error(Drive(), {.transposed = true}, "looks transposed");
  TempFolder folder;
  const bool vdo = GetParam() == LogFormat::vdo;
  const std::string name = vdo ? "obj_mot_x.txt" : "m_object_motion_log.csv";
  const auto line = [&](int k) {
    const SE3 T = about_y(0.1, {0, 0, 1});
    return vdo ? fmt::format("{} 1{}\n", k, row(T)) : fmt::format("{},1,{},{}\n", k, csv(T), csv(T));
  };
  const auto refused = [&](const std::string& text) {
    folder.write(name, text);
    try {
      read_object_logs(folder.path(), {.format = GetParam()});
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refused(line(1) + line(3) + line(2)), HasSubstr(":3: "));
  EXPECT_THAT(refused(line(1) + line(2) + line(2)), HasSubstr("is given twice in frame 2"));
  EXPECT_EQ(refused(line(1) + line(2)), "accepted");
}

INSTANTIATE_TEST_SUITE_P(Formats, ObjectDiagnosis, testing::Values(LogFormat::dynosam, LogFormat::vdo),
                         [](const auto& format) { return std::string(to_string(format.param)); });

TEST(DiagnosisByTruth, AnInvertedCameraIsNamedInAnyWorld) {
  const Drive drive;
  const SE3 world = about_y(1.3, {5, 0, 3});
  SequenceTruth truth;
  ObjectLog right, inverse;
  for (const auto& [k, C] : drive.camera.poses()) {
    truth.camera.set(k, world * C);
    right.camera.set(k, C);
    inverse.camera.set(k, (world * C).inverse());
  }
  EXPECT_TRUE(diagnose_log(right, truth).empty());
  const auto found = diagnose_log(inverse, truth);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].code, "inverse") << found[0].text;
}

TEST(DiagnosisByTruth, AStaticObjectIsNotACarThatFollowsTheCamera) {
  SequenceTruth truth;
  ObjectLog log;
  log.frame = MotionFrame::world;
  for (int k = 0; k < 6; ++k) {
    const SE3 C = about_y(0, {0, 0, 0.6 * k});
    truth.camera.set(k, C);
    log.camera.set(k, C);
    truth.objects[k].push_back({.id = 1, .T_camera_object = about_y(0, {0, 0, 8})});
    // Another object, 20 m away, stands still; its estimates move by some centimetres.
    if (k > 0) log.motions[{6, k}] = {about_y(0.001 * (k % 2), {0.02 * (k % 3), 0, 0.03 * (k % 2)}), {}};
  }
  EXPECT_TRUE(diagnose_log(log, truth).empty()) << diagnose_log(log, truth)[0].text;
}

TEST(DiagnosisByTruth, EstimatedMotionsAreComparedWithEstimatedPosesAsWell) {
  const Drive drive;
  SequenceTruth truth;
  ObjectLog log;
  log.frame = MotionFrame::world;
  for (const auto& [k, C] : drive.camera.poses()) {
    truth.camera.set(k, C);
    log.camera.set(k, C);
  }
  for (const auto& [key, L] : drive.L) {
    const auto [id, k] = key;
    truth.objects[k].push_back({.id = id, .T_camera_object = drive.camera.poses().at(k).inverse() * L});
    // Errors of the poses hide a shift against the truth, but not against these poses.
    log.poses[key] =
        L * about_y(0.05 * std::sin(7.0 * k), {0.5 * std::sin(5.0 * k), 0, 0.5 * std::sin(9.0 * k)});
  }
  for (const auto& [key, pose] : log.poses) {
    const auto before = log.poses.find(previous(key));
    const auto after = log.poses.find({key.first, key.second + 1});
    if (before != log.poses.end() && after != log.poses.end())
      log.motions[{key.first, key.second + 1}] = {pose * before->second.inverse(), {}};
  }
  const auto found = diagnose_log(log, truth);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].code, "lag_1") << found[0].text;
  EXPECT_THAT(found[0].text, HasSubstr("estimated motions against the estimated poses"));
}

TEST(DiagnosisOfLogs, RoundingOfAParkedCarIsNoMistake) {
  ObjectLog log;
  log.frame = MotionFrame::world;
  for (int k = 0; k < 20; ++k) {
    log.camera.set(k, about_y(0, {0, 0, 0.5 * k}));
    log.true_camera.set(k, about_y(0, {0, 0, 0.5 * k}));
    log.true_poses[{1, k}] = log.poses[{1, k}] = about_y(0.3, {4, 1, 20});
    if (k > 0) log.motions[{1, k}] = {about_y(0, {0, 0, 3e-15}), about_y(0, {0, 0, -7e-15})};
  }
  EXPECT_TRUE(diagnose_log(log).empty()) << diagnose_log(log)[0].text;
}

/// Returns a log of format poses, whose motions are the steps between the poses.
ObjectLog log_of_poses(const std::map<ObjectFrame, SE3>& poses,
                       const std::map<ObjectFrame, SE3>& true_poses) {
  ObjectLog log;
  log.frame = MotionFrame::world;
  log.holds_poses_only = true;
  log.poses = poses;
  log.true_poses = true_poses;
  for (const auto& [key, pose] : poses) {
    if (const auto H = world_step(poses, key)) log.motions[key] = {*H, world_step(true_poses, key).value()};
  }
  return log;
}

TEST(DiagnosisOfLogs, PosesAreNotCalledMotions) {
  const Drive drive;
  std::map<ObjectFrame, SE3> inverse;
  for (const auto& [key, L] : drive.L) inverse[key] = L.inverse();
  const auto found = diagnose_log(log_of_poses(inverse, drive.L));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].code, "inverse");
  EXPECT_THAT(found[0].text, HasSubstr("estimated poses of objects: the poses look inverted"));
}

TEST(DiagnosisOfLogs, PosesThatAreInverseInTruthAndEstimateAreNamedByTheirTurns) {
  std::map<ObjectFrame, SE3> poses, true_poses;
  SE3 pose = about_y(0.2, {3, 1, 12});
  for (int k = 0; k < 80; ++k) {
    true_poses[{2, k}] = pose.inverse();
    poses[{2, k}] =
        (pose * about_y(0.002 * std::sin(4.0 * k), {0.01, 0, 0.01 * std::sin(9.0 * k)})).inverse();
    pose = pose * about_y(0.08 * std::sin(0.05 * k), {0, 0, 0.9});
  }
  const auto found = diagnose_log(log_of_poses(poses, true_poses));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].code, "inverse");
  EXPECT_THAT(found[0].text, HasSubstr("invert each pose of both"));
}

TEST(DiagnosisOfLogs, CamerasThatBeginUpsideDownMayHaveQuaternionsWrittenWFirst) {
  ObjectLog log;
  for (int k = 0; k < 30; ++k) {
    const SE3 C = about_y(0.02 * k, {0.2 * k, 0, 0.8 * k});
    const Eigen::Quaterniond& q = C.rotation();
    const SE3 read(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), C.translation());  // w x y z as x y z w
    log.camera.set(k, read);
    log.true_camera.set(k, read);
  }
  const auto found = diagnose_log(log);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].code, "quaternion_w_first") << found[0].text;
}

TEST(QuaternionOrder, ShowsInBothColumnsAtOnce) {
  const TempFolder folder;
  std::string motions;
  for (int k = 1; k < 8; ++k) {
    const SE3 T = about_y(0.01 * k, {0, 0, 0.5 + 0.1 * k});
    const Eigen::Quaterniond& q = T.rotation();
    const std::string pose =
        fmt::format("0,0,{},{},{},{},{}", T.translation().z(), q.w(), q.x(), q.y(), q.z());
    motions += fmt::format("{},1,{},{}\n", k, pose, pose);
  }
  folder.write("m_object_motion_log.csv", motions);
  const auto found = diagnose_log(read_object_logs(folder.path(), {LogFormat::dynosam}).front());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].code, "quaternion_w_first");
  EXPECT_THAT(found[0].text, HasSubstr("true motions"));
}

}  // namespace
}  // namespace sextant
