#pragma once

// External programs for tests: a small sequence, and shell scripts that write results.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/base/testing.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/external/external_estimator.h"

namespace sextant {

/// A small VDO folder of frames 3-7 with one object, and programs that are shell scripts.
class ExternalEstimatorTest : public testing::Test {
 protected:
  ExternalEstimatorTest() {
    add_external_estimators();
    fixture_ = make_vdo_fixture(folder_.path() / "data", {.first_frame = 3});
    sequence_ = open_source(SourceSpec::parse(fixture_.source()));
  }

  std::filesystem::path file(const std::string& name) const { return folder_.path() / name; }

  /// Writes CONFIG of a program that runs `script` in sh, with {placeholders}; returns its name.
  std::string config(const std::string& script, Json more = Json::object()) const {
    write_file(file("program.sh"), "input=$1 output=$2 seed=$3\n" + script + "\n");
    more["command"] = "sh {config}/program.sh {input} {output} {seed}";
    write_file(file("program.json"), more.dump());
    return "external:" + file("program.json").string();
  }

  RunConfig run_config(const std::string& estimator, int n_seeds = 1) const {
    RunConfig c;
    c.sources = {SourceSpec::parse(fixture_.source())};
    c.estimator = estimator;
    c.n_seeds = n_seeds;
    c.quiet = true;
    return c;
  }
  RunResult run_with(const std::string& estimator, const std::string& noise = "none", int n_seeds = 1) const {
    RunConfig c = run_config(estimator, n_seeds);
    c.noise = Noise::parse(noise);
    c.folder = file("logs");
    return run(c);
  }
  /// Returns a sweep of `estimator` and motion_only over two levels of depth noise.
  SweepConfig sweep_config(const std::string& out, const Json& estimator, int n_seeds = 3,
                           int jobs = 1) const {
    SweepConfig c;
    const Json plan = {{"sources", {fixture_.source()}},
                       {"estimators", {estimator, "motion_only"}},
                       {"noise",
                        {{"parameter", "depth.delta_d_px"},
                         {"levels", {0.1, 0.2}},
                         {"base", {{"depth", {{"baseline_m", 0}}}}}}},
                       {"seeds", n_seeds}};
    c.plan = parse_plan(plan.dump(2), file("plan.json").string(), "");
    c.out = file(out);
    c.cache = PackCache(file("cache"));
    c.jobs = jobs;
    c.quiet = true;
    return c;
  }

  /// Runs `script`, which must not throw, and returns its problems.
  std::vector<std::string> problems_of(const std::string& script, const Json& more = Json::object()) {
    last_ = run_with(config(script, more));
    return last_.sources.front().problems;
  }
  /// Returns the only problem of a run of `script`.
  std::string problem_of(const std::string& script, const Json& more = Json::object()) {
    const std::vector<std::string> problems = problems_of(script, more);
    EXPECT_EQ(problems.size(), 1U);
    return problems.empty() ? "" : problems.front();
  }
  /// Runs `script` and expects no problems.
  void run_well(const std::string& script, const Json& more = Json::object()) {
    EXPECT_THAT(problems_of(script, more), ElementsAre());
  }

  fs::path case_folder() const { return file("logs") / "vdo_data_3-7_seed0"; }
  std::string log() const { return read_file(case_folder() / "log.txt"); }
  std::string output_of_program() const { return read_file(case_folder() / "stdout.txt"); }

  std::vector<std::string> statuses(const std::string& body) const {
    std::vector<std::string> out;
    for (const Record& record : last_.records) {
      if (record.body == body) out.emplace_back(to_string(record.status));
    }
    return out;
  }

  /// Returns the largest error of a body in the last run; -1 if there is none.
  double worst(const std::string& body, const std::string& key) const {
    double worst = -1;
    for (const Record& record : last_.records) {
      if (record.body == body && record.errors.contains(key)) worst = std::max(worst, record.errors.at(key));
    }
    return worst;
  }

  SE3 T_world_camera(int frame) const { return fixture_.T_world_camera.at(frame); }
  SE3 T_world_object(int frame) const { return fixture_.T_world_object.at(frame); }
  /// Converts a pose to the program's own world frame, which differs from that of the truth.
  SE3 own(const SE3& T_world_x) const { return T_world_camera(3).inverse() * T_world_x; }

  static std::string kitti_row(const SE3& T) {
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> m = T.matrix().topRows<3>();
    return fmt::format("{:.17g}", fmt::join(m.data(), m.data() + m.size(), " "));
  }
  static std::string tum_row(const SE3& T, const char* separator = " ") {
    const Eigen::Vector3d& t = T.translation();
    const Eigen::Vector4d& q = T.rotation().coeffs();  // x y z w
    return fmt::format("{:.17g}{}{:.17g}", fmt::join(t, separator), separator, fmt::join(q, separator));
  }

  /// Writes a line for every frame, line(frame).
  template <typename Line>
  void write_results(const std::string& name, const Line& line, int first = 3) const {
    std::string text;
    for (int frame = first; frame <= 7; ++frame) text += line(frame) + "\n";
    write_file(file(name), text);
  }
  /// Writes poses in the program's own world frame, each preceded by its frame number.
  template <typename Pose>
  void write_poses(const std::string& name, const Pose& pose, int first = 3, int shift = 0) const {
    write_results(
        name, [&](int k) { return fmt::format("{} {}", k + shift, kitti_row(pose(k))); }, first);
  }
  void write_camera(const std::string& name = "camera.txt", int shift = 0) const {
    write_poses(
        name, [&](int k) { return own(T_world_camera(k)); }, 3, shift);
  }
  /// Returns H of object 1.
  SE3 world(int k) const { return own(T_world_object(k)) * own(T_world_object(k - 1)).inverse(); }
  SE3 body(int k) const { return T_world_object(k - 1).inverse() * T_world_object(k); }
  void write_motions(const std::string& name = "obj_1.txt", int first = 4, int shift = 0) const {
    write_poses(
        name, [&](int k) { return world(k); }, first, shift);
  }

  // Files of VDO-SLAM.

  static std::string matrix_row(int frame, const SE3& T) {
    return fmt::format("{} {} 0 0 0 1", frame, kitti_row(T));
  }

  /// Writes the files of VDO-SLAM's System::SaveResults(), with its names. Poses and motions of the front end
  /// have errors of 0.1 m.
  void write_vdo_results(int label = 1) const {
    const SE3 off(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0, 0));
    fs::create_directories(file("vdo"));
    const auto motions = [&](const char* name, const SE3& error) {
      write_results(
          fmt::format("vdo/{}", name),
          [&](int k) { return fmt::format("{} {} {} 0 0 0 1", k, label, kitti_row(body(k) * error)); }, 4);
    };
    motions("obj_mot_stereo_new.txt", off);
    motions("obj_mot_stereo_rf_new.txt", SE3());
    motions("obj_mot_gt.txt", SE3());
    write_results(
        "vdo/obj_centre.txt", [&](int k) { return fmt::format("{} {} 1.5 2.5 9.5", k, label); }, 4);
    write_results("vdo/initial_stereo_new.txt", [&](int k) {
      return matrix_row(k, k % 2 == 0 ? own(T_world_camera(k)) * off : own(T_world_camera(k)));
    });
    write_results("vdo/refined_stereo_new.txt", [&](int k) { return matrix_row(k, own(T_world_camera(k))); });
    write_results("vdo/cam_pose_gt_stereo.txt", [&](int k) { return matrix_row(k, own(T_world_camera(k))); });
  }
  static Json vdo_set(const std::string& stage, const std::string& ids = "masks") {
    return {{"camera", {{"file", stage + "_*.txt"}}},
            {"objects", {{"format", "vdo"}, {"stage", stage}, {"ids", ids}}}};
  }

  TempFolder folder_;
  VdoFixture fixture_;
  std::unique_ptr<Sequence> sequence_;
  RunResult last_;
  const Json motions_ = {{"objects", {{"format", "motions"}}}};
};

inline const std::vector<std::string> lost4(4, "lost"), ok4(4, "ok"), diverged4(4, "diverged"),
    not_detected4(4, "not_detected");

}  // namespace sextant
