#include "sextant/eval/logs/object_logs.h"

#include "sextant/base/error.h"
#include "sextant/base/testing.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/logs/object_association.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {
namespace {

constexpr double dt = 0.1;

/// A car that drives and turns, observed from a moving camera; the estimate has the error `error` in its own
/// frame.
SE3 car(int frame) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.05 * frame, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d(20 + 0.1 * frame, 1, 30 + 1.2 * frame)};
}
SE3 camera(int frame) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.01 * frame, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d(0, 0, 0.9 * frame)};
}
const SE3 reported(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX())),
                   Eigen::Vector3d(0.03, 0, 0.04));

std::string row(const SE3& T) {
  const Eigen::Quaterniond& q = T.rotation();
  return fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}", T.translation()[0],
                     T.translation()[1], T.translation()[2], q.x(), q.y(), q.z(), q.w());
}
std::string matrix(const SE3& T) {
  std::string text;
  for (int i = 0; i < 16; ++i) text += fmt::format(" {:.17g}", T.matrix()(i / 4, i % 4));
  return text;
}
SE3 body_truth(int k) { return body_motion(car(k) * car(k - 1).inverse(), car(k - 1)); }
SE3 body_estimate(int k) {
  return body_truth(k) * reported.inverse();
}  // E = inverse(estimate) truth = reported
SE3 world_of(const SE3& body, int k) { return car(k - 1) * body * car(k - 1).inverse(); }

constexpr int n_frames = 8;

/// Writes motions of frames 1..7 except 5, with the id `id`.
void write_dynosam(const TempFolder& folder, int id) {
  std::string motions = "frame_id,object_id,...\n", poses = motions, cameras = "frame_id,...\n";
  for (int k = 0; k < n_frames; ++k) {
    cameras += fmt::format("{},{},{}\n", k, row(camera(k)), row(camera(k)));
    poses += fmt::format("{},{},{},{}\n", k, id, row(car(k)), row(car(k)));
    if (k == 0 || k == 5) continue;
    motions += fmt::format("{},{},{},{}\n", k, id, row(world_of(body_estimate(k), k)),
                           row(world_of(body_truth(k), k)));
  }
  folder.write("m_object_motion_log.csv", motions);
  folder.write("m_object_pose_log.csv", poses);
  folder.write("m_camera_pose_log.csv", cameras);
}

const MetricPreset& preset(const char* name) { return find_preset(name); }

TEST(ObjectLogs, DynosamUnderEveryPreset) {
  const TempFolder folder;
  write_dynosam(folder, 3);
  const std::vector<ObjectLog> logs = read_object_logs(folder.path(), {LogFormat::dynosam});
  ASSERT_EQ(logs.size(), 1);
  EXPECT_EQ(logs[0].estimator, "m");
  const std::vector<Record> records = object_records(logs[0], "dynosam", "s", 1 / dt);
  ASSERT_EQ(records.size(), 7);  // steps 1..7
  for (const Record& r : records) {
    if (r.frame == 5) {
      EXPECT_EQ(r.status, Status::lost);
      continue;
    }
    ASSERT_EQ(r.status, Status::ok);
    const int k = r.frame;
    EXPECT_NEAR(r.errors.at("Et_body_m"), 0.05, 1e-9);
    EXPECT_NEAR(r.errors.at("ER_body_deg"), 0.01 * 180 / EIGEN_PI, 1e-7);
    const SE3 H = world_of(body_truth(k), k), G = world_of(body_estimate(k), k);
    EXPECT_NEAR(r.errors.at("Et_world_m"), (G.inverse() * H).translation().norm(), 1e-9);
    const SE3 X = camera(k).inverse() * H * camera(k - 1), Y = camera(k).inverse() * G * camera(k - 1);
    EXPECT_NEAR(r.errors.at("Et_m"), (Y.inverse() * X).translation().norm(), 1e-9);
    EXPECT_NEAR(r.values.at("v_gt_kmh"), (car(k).translation() - car(k - 1).translation()).norm() / dt * 3.6,
                1e-6);
  }
  const Json rows = rows_to_json(object_table(records, {&preset("dynosam_rme"), 1}));
  EXPECT_EQ(rows[0]["n_truth"], 7);
  EXPECT_EQ(rows[0]["n_estimated"], 6);
  EXPECT_NEAR(rows[0]["Et_m"], 0.05, 1e-9);
  EXPECT_EQ(rows[0]["other"], "lost 1");
}

TEST(ObjectLogs, TheRateOfDynosamHasAllDigitsOfItsStamps) {
  const TempFolder folder;
  write_dynosam(folder, 3);
  constexpr int64_t first_ns = 1'700'000'000'123'456'789, step_ns = 33'333'333;
  std::string times = "frame_id,timestamp [ns]\n";
  for (int k = 0; k < 9; ++k) times += fmt::format("{},{}\n", k, first_ns + k * step_ns);
  folder.write("frame_id_timestamp.csv", times);
  const ObjectLog log = read_object_logs(folder.path(), {LogFormat::dynosam}).front();
  EXPECT_NEAR(log.rate_hz.value(), 1e9 / step_ns, 1e-12);
}

TEST(ObjectLogs, IdentityTruthIsMissingTruth) {
  const TempFolder folder;
  folder.write("m_object_motion_log.csv",
               fmt::format("1,3,{},0,0,0,0,0,0,1\n2,3,{},{}\n", row(reported), row(reported), row(reported)));
  const ObjectLog log = read_object_logs(folder.path(), {LogFormat::dynosam}).front();
  EXPECT_FALSE(log.motions.at({3, 1}).truth);
  EXPECT_TRUE(log.motions.at({3, 2}).truth);
  EXPECT_THAT(log.warnings, Contains(HasSubstr("exactly the identity")));
  EXPECT_EQ(object_records(log, "d", "s", 10)[0].status, Status::no_truth);
}

TEST(ObjectLogs, VdoInTheBodyFrame) {
  const TempFolder folder;
  std::string estimate, truth;
  for (int k = 1; k < n_frames; ++k) {
    estimate += fmt::format("{} 3{}\n", k, matrix(body_estimate(k)));
    truth += fmt::format("{} 3{}\n", k, matrix(body_truth(k)));
  }
  folder.write("obj_mot_rgbd_new.txt", estimate);
  folder.write("obj_mot_gt.txt", truth);
  const std::vector<Record> records =
      object_records(read_object_logs(folder.path(), {LogFormat::vdo}).front(), "vdo", "s", 1 / dt);
  ASSERT_EQ(records.size(), 7);
  EXPECT_NEAR(records[0].errors.at("Et_body_m"), 0.05, 1e-9);
  EXPECT_FALSE(records[0].errors.contains("Et_m")) << "needs poses that this log does not have";
  const Json rows = rows_to_json(object_table(records, metric_presets()));
  EXPECT_FALSE(rows[0].contains("Et_m"));  // preset paper
  EXPECT_EQ(rows[0]["coverage_percent"], 100);
}

TEST(ObjectLogs, VdoFolderOfBothStages) {
  const TempFolder folder;
  std::string initial, refined, truth, early, late;
  const SE3 off(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.5, 0, 0));
  for (int k = 1; k < n_frames; ++k) {
    initial += fmt::format("{} 3{}\n", k, matrix(body_estimate(k)));
    refined += fmt::format("{} 3{}\n", k, matrix(body_truth(k)));
    early += fmt::format("{}{}\n", k, matrix(camera(k) * off));
    late += fmt::format("{}{}\n", k, matrix(camera(k)));
  }
  folder.write("obj_mot_stereo_new.txt", initial);
  folder.write("obj_mot_stereo_rf_new.txt", refined);
  folder.write("obj_mot_gt.txt", refined);
  folder.write("obj_centre.txt", "1 3 0 0 9\n");
  folder.write("initial_stereo_new.txt", early);
  folder.write("refined_stereo_new.txt", late);
  EXPECT_THAT(
      error_of([&] { read_object_logs(folder.path(), {LogFormat::vdo}); }),
      HasSubstr("obj_mot_stereo_new.txt (initial) and obj_mot_stereo_rf_new.txt (refined): choose one"));
  const auto read = [&](const char* stage) {
    return read_object_logs(folder.path(), {LogFormat::vdo, from_name<LogStage>(stage, "stage")}).front();
  };
  EXPECT_NEAR(object_records(read("initial"), "vdo", "s", 10)[0].errors.at("Et_body_m"), 0.05, 1e-9);
  EXPECT_NEAR(object_records(read("refined"), "vdo", "s", 10)[0].errors.at("Et_body_m"), 0, 1e-9);
  EXPECT_NEAR((read("initial").camera.pose(2)->translation() - camera(2).translation()).norm(), 0.5, 1e-9);
  EXPECT_NEAR((read("refined").camera.pose(2)->translation() - camera(2).translation()).norm(), 0, 1e-9);
  expect_error([&] { read("final"); }, "unknown stage 'final'");
  expect_error(
      [&] {
        read_object_logs(folder.path(), {LogFormat::dynosam, LogStage::refined});
      },
      "only results of format vdo have stages");
  folder.write("b_refined_stereo_new.txt", late);
  expect_error([&] { read("initial"); }, "holds several refined_*.txt: keep one run per folder");
  std::filesystem::remove(folder.path() / "b_refined_stereo_new.txt");
  std::filesystem::remove(folder.path() / "obj_mot_stereo_rf_new.txt");
  EXPECT_NEAR(object_records(read("any"), "vdo", "s", 10)[0].errors.at("Et_body_m"), 0.05, 1e-9);
  expect_error([&] { read("refined"); }, "holds no obj_mot_*_rf*.txt");
}

TEST(ObjectLogs, SpeedsAreOverTheStepsOfTheirError) {
  std::vector<Record> records(2);
  for (int i = 0; i < 2; ++i) {
    records[i].estimator = "m";
    records[i].body = "object:3";
    records[i].frame = i + 1;
    records[i].values = {{"v_kmh", 10.0 + i}, {"v_gt_kmh", 20.0 + i}};
  }
  records[1].errors["Ev_kmh"] = 10;
  const Json rows = rows_to_json(object_table(records, {&preset("paper"), 1}));
  EXPECT_EQ(rows[0]["v_kmh"], 11);
  EXPECT_EQ(rows[0]["v_gt_kmh"], 21);
}

TEST(ObjectLogs, ObjectsWithoutAPartnerHaveTheIdOfTheLogInTables) {
  std::vector<Record> records(1);
  records[0].estimator = "m";
  records[0].body = object_body(unmatched_object + 3);
  const Json rows = rows_to_json(object_table(records, {&preset("paper"), 1}));
  EXPECT_EQ(rows[0]["object"], "3 of the log");
}

TEST(ObjectLogs, TruthOfASourceMatchesIdsByOverlap) {
  const TempFolder folder;
  write_dynosam(folder, 40);
  SequenceTruth truth;
  for (int k = 0; k < n_frames; ++k) {
    truth.camera.set(k, camera(k));
    ObjectTruth right, other;
    right.id = 7;
    right.T_camera_object = camera(k).inverse() * car(k);
    other.id = 40;  // the log's id, but another car that drives the other way
    other.T_camera_object =
        camera(k).inverse() * SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-4, 1, 60 - 2.0 * k));
    truth.objects[k] = {right, other};
  }
  ObjectLog log = read_object_logs(folder.path(), {LogFormat::dynosam}).front();
  take_truth(log, truth);
  EXPECT_THAT(log.warnings, Contains("logged object 40 is true object 7, by overlap"));
  int ok = 0, not_detected = 0;
  for (const Record& r : object_records(log, "d", "s", 10)) {
    ok += r.body == "object:7" && r.status == Status::ok;
    not_detected += r.body == "object:40" && r.status == Status::not_detected;
    if (r.status == Status::ok) {
      EXPECT_NEAR(r.errors.at("Et_body_m"), 0.05, 1e-9);
    }
  }
  EXPECT_EQ(ok, 6);
  EXPECT_EQ(not_detected, 7);
}

/// Returns the truth of object 9 with the poses `pose_of(k)` of frames 0 to n - 1, and the data set's flag
/// `moves(k)`, which describes the step from frame k to the next one.
SequenceTruth truth_of_one(int n, const std::function<SE3(int)>& pose_of,
                           const std::function<bool(int)>& moves) {
  SequenceTruth truth;
  for (int k = 0; k < n; ++k) {
    truth.camera.set(k, camera(k));
    ObjectTruth object;
    object.id = 9;
    object.T_camera_object = camera(k).inverse() * pose_of(k);
    object.moving = moves(k);
    truth.objects[k] = {object};
  }
  return truth;
}

/// Returns the frames in which the exact log of these poses has truth.
std::vector<int> frames_with_truth(int n, const std::function<SE3(int)>& pose_of,
                                   const std::function<bool(int)>& moves) {
  ObjectLog log;
  for (int k = 1; k < n; ++k) log.motions[{9, k}].estimate = pose_of(k) * pose_of(k - 1).inverse();
  take_truth(log, truth_of_one(n, pose_of, moves));
  std::vector<int> frames;
  for (const Record& r : object_records(log, "d", "s", 10)) {
    EXPECT_TRUE(r.status == Status::ok || r.status == Status::no_truth) << r.frame;
    if (r.status == Status::ok) frames.push_back(r.frame);
  }
  return frames;
}

TEST(ObjectLogs, TheLastStepOfAnObjectThatHaltsHasTruth) {
  const auto halts = [](int k) { return car(std::min(k, 3)); };
  EXPECT_THAT(frames_with_truth(n_frames, halts, [](int k) { return k < 3; }), ElementsAre(1, 2, 3));
}

TEST(ObjectLogs, AStepInWhichAnObjectRestsHasNoTruth) {
  EXPECT_THAT(frames_with_truth(n_frames, car, [](int k) { return k != 3; }), ElementsAre(1, 2, 3, 5, 6, 7));
}

TEST(ObjectLogs, ALogOfOneStepNeedsNoMore) {
  EXPECT_THAT(frames_with_truth(2, car, [](int) { return true; }), ElementsAre(1));
}

/// Returns the truth of `car`, as object 7, and of another car next to it with the same motion, as object 3.
SequenceTruth two_alike() {
  SequenceTruth truth;
  const SE3 beside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(4, 0, 0));
  for (int k = 0; k < n_frames; ++k) {
    truth.camera.set(k, camera(k));
    ObjectTruth other, right;
    other.id = 3;
    other.T_camera_object = camera(k).inverse() * beside * car(k);
    right.id = 7;
    right.T_camera_object = camera(k).inverse() * car(k);
    truth.objects[k] = {other, right};
  }
  return truth;
}

TEST(ObjectLogs, PositionsDistinguishObjectsWithEqualMotion) {
  const TempFolder folder;
  write_dynosam(folder, 40);
  ObjectLog log = read_object_logs(folder.path(), {LogFormat::dynosam}).front();
  take_truth(log, two_alike());
  EXPECT_THAT(log.warnings, Contains("logged object 40 is true object 7, by overlap"));
}

/// Returns the exact log of `car` with the id `id_at(k)` in frame k, and as object 60 too if `twice`.
ObjectLog log_of_car(const std::function<int(int)>& id_at, bool twice = false) {
  ObjectLog log;
  for (int k = 0; k < n_frames; ++k) {
    log.camera.set(k, camera(k));
    for (const int id : {id_at(k), 60}) {
      if (id == 60 && !twice) continue;
      log.poses[{id, k}] = car(k);
      if (k > 0) log.motions[{id, k}].estimate = car(k) * car(k - 1).inverse();
    }
  }
  return log;
}

/// Returns the truth of `car`, as object 7, and of object 3, a slow car that it approaches to less than 3 m
/// in the last frames.
SequenceTruth passing() {
  SequenceTruth truth = two_alike();
  for (auto& [k, objects] : truth.objects) {
    objects.front().T_camera_object =
        camera(k).inverse() *
        SE3(Eigen::Quaterniond::Identity(), car(6).translation() + Eigen::Vector3d(0.5 * (k - 6), 0, 0));
  }
  return truth;
}

TEST(ObjectLogs, AnObjectThatChangesItsIdIsNotGivenToAStrangerNearby) {
  ObjectLog log = log_of_car([](int k) { return k < 4 ? 1 : 8; });
  take_truth(log, passing());
  EXPECT_THAT(log.warnings, Contains(HasSubstr("the log changes the id of this object")));
  for (const auto& [key, motion] : log.motions) {
    EXPECT_NE(key.first, 3) << key.second;
    EXPECT_EQ(motion.truth.has_value(), key.first == 7) << key.second;
  }
}

TEST(ObjectLogs, AnObjectThatIsLoggedTwiceIsScoredOnce) {
  ObjectLog log = log_of_car([](int) { return 1; }, true);
  take_truth(log, passing());
  EXPECT_THAT(log.warnings,
              Contains(HasSubstr("logged object 60 follows true object 7 in frames 1-7, and logged "
                                 "object 1 does so in 7 of these frames")));
  EXPECT_EQ(std::ranges::count_if(log.motions, [](const auto& at) { return at.second.truth.has_value(); }),
            7);
}

TEST(ObjectLogs, ObjectsThatExchangeTheirIdsAreNotTakenForAnObjectThatIsLoggedTwice) {
  const SE3 beside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(4, 0, 0));
  ObjectLog log;
  for (int k = 0; k < n_frames; ++k) {
    log.camera.set(k, camera(k));
    // Each has more steps near `car`, the true object 7: object 1 at the end, object 2 at the beginning.
    log.poses[{1, k}] = k < 3 ? beside * car(k) : car(k);
    log.poses[{2, k}] = k < 5 ? car(k) : beside * car(k);
    if (k == 0) continue;
    if (k != 1) log.motions[{1, k}].estimate = car(k) * car(k - 1).inverse();
    if (k < 6) log.motions[{2, k}].estimate = car(k) * car(k - 1).inverse();
  }
  take_truth(log, two_alike());
  EXPECT_THAT(log.warnings, Contains(AllOf(HasSubstr("logged object 2 follows true object 7 in frames 1-4"),
                                           HasSubstr("the log changes the id of this object"))));
}

TEST(ObjectLogs, ACopyOfAnObjectIsNamedWithoutTruth) {
  const TempFolder folder;
  write_dynosam(folder, 3);
  const auto warnings = [&] {
    return read_object_logs(folder.path(), {LogFormat::dynosam}).front().warnings;
  };
  EXPECT_THAT(warnings(), Not(Contains(HasSubstr("exactly the same"))));
  std::string motions = "frame_id,object_id,...\n";
  for (int k = 1; k < n_frames; ++k) {
    for (const int id : {3, 9})
      motions += fmt::format("{},{},{},{}\n", k, id, row(world_of(body_estimate(k), k)),
                             row(world_of(body_truth(k), k)));
  }
  folder.write("m_object_motion_log.csv", motions);
  EXPECT_THAT(warnings(), Contains(HasSubstr("exactly the same motions have objects 3 and 9 (7)")));
}

TEST(ObjectLogs, ALogInAnotherWorldIsMovedToThatOfTheTruth) {
  const SE3 elsewhere(Eigen::Quaterniond(Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 3).normalized())),
                      Eigen::Vector3d(-50, 3, 8));
  ObjectLog log;
  for (int k = 0; k < n_frames; ++k) {
    log.camera.set(k, elsewhere * camera(k));
    log.poses[{9, k}] = elsewhere * car(k);
    if (k > 0) log.motions[{9, k}].estimate = elsewhere * world_of(body_estimate(k), k) * elsewhere.inverse();
  }
  take_truth(log, two_alike());
  int n = 0;
  for (const Record& r : object_records(log, "d", "s", 10)) {
    if (r.status != Status::ok) continue;
    ++n;
    EXPECT_EQ(r.body, "object:7");
    EXPECT_NEAR(r.errors.at("Et_body_m"), 0.05, 1e-9);
    EXPECT_LT(r.errors.at("Et_world_m"), 1);
  }
  EXPECT_EQ(n, n_frames - 1);
}

TEST(ObjectLogs, AnUnloggedPoseBeforeAStepFollowsFromItsTruth) {
  const TempFolder folder;
  folder.write("m_object_motion_log.csv", fmt::format("4,3,{},{}\n", row(world_of(body_estimate(4), 4)),
                                                      row(world_of(body_truth(4), 4))));
  folder.write("m_object_pose_log.csv", fmt::format("4,3,{},{}\n", row(car(4)), row(car(4))));
  const std::vector<Record> records =
      object_records(read_object_logs(folder.path(), {LogFormat::dynosam}).front(), "d", "s", 10);
  ASSERT_EQ(records.size(), 1);
  EXPECT_NEAR(records[0].errors.at("Et_body_m"), 0.05, 1e-9);
}

TEST(ObjectLogs, MotionsAreChainedFromTheTruePoseBeforeThem) {
  ObjectLog log;
  log.frame = MotionFrame::body;
  for (const int k : {1, 2, 5}) {
    log.motions[{3, k}].estimate = body_truth(k);
    if (k != 2) log.true_poses[{3, k - 1}] = car(k - 1);
  }
  log.motions[{3, 7}].estimate = body_truth(7);  // no pose to start from
  const std::map<ObjectFrame, SE3> poses = chained_poses(log);
  std::vector<int> frames;
  for (const auto& [key, pose] : poses) {
    frames.push_back(key.second);
    EXPECT_LT(pose_change_error(pose, car(key.second)).Et_m, 1e-12);
  }
  EXPECT_EQ(frames, (std::vector<int>{0, 1, 2, 4, 5}));
}

TEST(ObjectLogs, DamageIsReported) {
  const TempFolder folder;
  const auto error = [&](LogFormat format) {
    return error_of([&] { read_object_logs(folder.path(), {format}); });
  };
  EXPECT_THAT(error(LogFormat::dynosam), HasSubstr("holds no <module>_object_motion_log.csv"));
  EXPECT_THAT(error(LogFormat::vdo), HasSubstr("holds no obj_mot_*.txt besides the truth, obj_mot_gt*.txt"));
  folder.write("m_object_motion_log.csv", "frame_id\n1,3,0,0\n");
  EXPECT_THAT(error(LogFormat::dynosam), HasSubstr("m_object_motion_log.csv:2: expected frame_id,object_id"));
  folder.write("m_object_motion_log.csv",
               "frame_id,object_id,tx,ty,tz,qw,qx,qy,qz,gt_tx,gt_ty,gt_tz,gt_qw,gt_qx,gt_qy,gt_qz\n"
               "1,3,0,0,0,1,0,0,0,0,0,1,1,0,0,0\n");
  EXPECT_THAT(error(LogFormat::dynosam),
              HasSubstr(":2: the header names other columns than frame_id,object_id"));
  folder.write("obj_mot_x.txt", fmt::format("1 3{}\n1 3{}\n", matrix(reported), matrix(reported)));
  EXPECT_THAT(error(LogFormat::vdo), HasSubstr(":2: label 3 is given twice in frame 1"));
  folder.write("a_refined_rgbd.txt", "");
  folder.write("b_refined_rgbd.txt", "");
  EXPECT_THAT(error(LogFormat::vdo), HasSubstr("holds several refined_*.txt: keep one run per folder"));
  expect_error([] { read_object_logs("/nowhere", {LogFormat::vdo}); }, "cannot read this folder");
}

}  // namespace
}  // namespace sextant
