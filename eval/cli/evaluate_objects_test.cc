// `sextant evaluate objects` as a user starts it.

#include <functional>

#include "sextant/base/files.h"
#include "sextant/base/options.h"
#include "sextant/eval/cli/testing.h"

namespace sextant {
namespace {

std::string csv(const SE3& T) {
  const Eigen::Vector3d& t = T.translation();
  const Eigen::Quaterniond& q = T.rotation();
  return fmt::format("{},{},{},{},{},{},{}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

/// DynOSAM logs of a scene whose object is called 5, without truth, and the scene with truth.
class EvaluateObjects : public testing::Test {
 protected:
  EvaluateObjects() {
    scene_ = make_vdo_fixture(temp_.path() / "scene", {.n_frames = 6, .width = 64, .height = 32});
    std::string motions =
        "frame_id,object_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw\n";
    std::string cameras = "frame_id,tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw\n";
    const std::string missing = csv(SE3());
    for (const auto& [k, pose] : scene_.T_world_camera) {
      cameras += fmt::format("{},{},{}\n", k, csv(pose), missing);
      if (k == 0 || k == 3) continue;  // lost once
      const SE3 H = scene_.T_world_object.at(k) * scene_.T_world_object.at(k - 1).inverse();
      motions += fmt::format("{},5,{},{}\n", k, csv(H), missing);
    }
    put("m_object_motion_log.csv", motions);
    put("m_camera_pose_log.csv", cameras);
  }

  void put(const std::string& name, const std::string& bytes) const { write_file(logs() / name, bytes); }
  fs::path logs() const {
    fs::create_directories(temp_.path() / "logs");
    return temp_.path() / "logs";
  }

  Outcome evaluate(const std::string& more) const {
    return sextant_program(fmt::format("evaluate objects {} {}", logs().string(), more));
  }
  void expect_refused(const std::string& named) const {
    expect_bad_input(evaluate("--format dynosam"), named);
  }

  TempFolder temp_;
  VdoFixture scene_;
};

TEST_F(EvaluateObjects, TruthOfASourceIsMatchedByOverlap) {
  const Outcome outcome = evaluate(fmt::format("--format dynosam --truth {} --json", scene_.source()));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  ASSERT_EQ(json["presets"].size(), 5U);
  for (const Json& preset : json["presets"]) {
    const Json& row = preset["rows"][0];
    EXPECT_EQ(row["object"], "1") << preset["preset"];
    EXPECT_EQ(row["n_truth"], 5) << preset["preset"];
    EXPECT_EQ(row["n_estimated"], 4) << preset["preset"];
    EXPECT_EQ(row["coverage_percent"], 80) << preset["preset"];
    EXPECT_LT(row["Et_m"].get<double>(), 1e-6) << preset["preset"];
    EXPECT_LT(row["Ev_kmh"].get<double>(), 1e-4) << preset["preset"];
  }
  EXPECT_THAT(json["warnings"].dump(), HasSubstr("logged object 5 is true object 1, by overlap"));
}

TEST_F(EvaluateObjects, TheStageOfAVdoFolderIsChosen) {
  const auto motions = [&](double off_m) {
    std::string text;
    for (int k = 1; k < 6; ++k) {
      SE3 motion = scene_.T_world_object.at(k - 1).inverse() * scene_.T_world_object.at(k);
      motion = motion * SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(off_m, 0, 0));
      text += fmt::format("{} 1", k);
      for (int i = 0; i < 16; ++i) text += fmt::format(" {}", motion.matrix()(i / 4, i % 4));
      text += "\n";
    }
    return text;
  };
  put("obj_mot_stereo_new.txt", motions(0.25));
  put("obj_mot_stereo_rf_new.txt", motions(0));
  put("obj_mot_gt.txt", motions(0));
  const Outcome refused = evaluate("--format vdo");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("choose one with --stage"));
  const auto Et_m = [&](const std::string& stage) {
    const Outcome outcome = evaluate("--format vdo --preset vdo_slam --json --stage " + stage);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return Json::parse(outcome.out)["presets"][0]["rows"][0]["Et_m"].get<double>();
  };
  EXPECT_NEAR(Et_m("initial"), 0.25, 1e-6);
  EXPECT_NEAR(Et_m("refined"), 0, 1e-6);
  EXPECT_EQ(evaluate("--format vdo --stage last").code, 2);
}

TEST_F(EvaluateObjects, WithoutTruthNothingIsCompared) {
  const Outcome outcome = evaluate("--format dynosam --preset paper --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json row = Json::parse(outcome.out)["presets"][0]["rows"][0];
  EXPECT_EQ(row["n_truth"], 0);
  EXPECT_FALSE(row.contains("Et_m") && !row["Et_m"].is_null()) << row;
}

TEST_F(EvaluateObjects, SeveralRunsArePooledComparedAndReported) {
  const fs::path report = temp_.path() / "report";
  const std::string more = fmt::format("--truth {} --format dynosam", scene_.source());
  const Outcome outcome =
      evaluate(fmt::format("a={0} b={0} {1} --out {2} --json", logs().string(), more, report.string()));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  ASSERT_EQ(json["systems"].size(),
            15U);  // 5 presets, 3 systems: the folder alone is called after its module
  EXPECT_EQ(json["systems"][0]["system"], "a");
  EXPECT_EQ(json["systems"][0]["runs"], 1);
  for (const char* file : {"report.html", "records.jsonl", "tables/systems.csv", "figures/Et_body_cdf.svg",
                           "figures/ER_camera_boxes.png"}) {
    EXPECT_TRUE(fs::exists(report / file)) << file;
  }
  const Json apart = Json::parse(evaluate(fmt::format("{} {} --json", logs().string(), more)).out);
  EXPECT_EQ(apart["systems"].size(), 10U) << "5 presets, two folders without names are two systems";
  const Json pooled = Json::parse(evaluate(fmt::format("a={0} a={0} {1} --json", logs().string(), more)).out);
  EXPECT_EQ(pooled["systems"][0]["runs"], 1) << "the same run twice";
  EXPECT_EQ(pooled["presets"][0]["rows"][0]["n_truth"], 5) << "in all tables";
  EXPECT_FALSE(pooled["systems"][0].contains("Et_low_m"));
  const Json five = Json::parse(
      evaluate(fmt::format("a={0} a={0} a={0} a={0} a={0} {1} --json", logs().string(), more)).out);
  for (const Json& system : five["systems"])
    EXPECT_FALSE(system.contains("Et_low_m")) << "an interval over copies of one run: " << system;
  EXPECT_THAT(five["warnings"].dump(), HasSubstr("run 5 has the same errors as run 1"));
}

TEST_F(EvaluateObjects, DamagedLogsAreRefused) {
  const std::string name = "m_object_motion_log.csv";
  const std::string good = read_file(logs() / name);
  const auto with = [&](const std::function<void(std::string&)>& damage) {
    std::string bytes = good;
    damage(bytes);
    put(name, bytes);
  };
  const size_t line2 = good.find('\n') + 1;
  with([](std::string& b) { b.clear(); });
  expect_refused("holds no motion");
  with([&](std::string& b) { b.resize(line2); });
  expect_refused("holds no motion");
  with([&](std::string& b) { b.replace(line2 + 4, 3, "nan"); });
  expect_refused(name + ":2: ");
  with([&](std::string& b) { b.erase(b.rfind(',')); });
  expect_refused("got 15 values");
  with([&](std::string& b) { b.insert(line2 + 4, "1,234."); });
  expect_refused(name + ":2: ");
  const std::string first = good.substr(line2, good.find('\n', line2) + 1 - line2);
  with([&](std::string& b) { b.insert(line2, first); });
  expect_refused("is given twice");
  with([&](std::string& b) { b += first; });
  expect_refused("expected ascending frames");
  with([&](std::string& b) { b.replace(line2, 1, "1.5"); });
  expect_refused("expected a frame number");
  with([&](std::string& b) { b.replace(line2, 1, "-1"); });
  expect_refused("expected a frame number");
  with([](std::string& b) {
    b.assign(
        "\xff\xfe"
        "f\0r\0",
        6);
  });
  expect_refused("UTF-16");
}

TEST_F(EvaluateObjects, EndsOfLinesAndByteOrderMarksAreRead) {
  const std::string name = "m_object_motion_log.csv";
  const std::string wanted = evaluate("--format dynosam --json").out;
  std::string bytes = "\xef\xbb\xbf";
  for (const char c : read_file(logs() / name)) bytes += c == '\n' ? std::string("\r\n") : std::string(1, c);
  put(name, bytes);
  const Outcome outcome = evaluate("--format dynosam --json");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, wanted);
}

}  // namespace
}  // namespace sextant
