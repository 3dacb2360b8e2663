#include "sextant/eval/external/external_testing.h"

#include <chrono>
#include <fstream>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"

namespace sextant {
namespace {

using testing::Each;

// ---- results that are read correctly

TEST_F(ExternalEstimatorTest, TheWorkedExampleRuns) {
  write_file(file("example.json"), read_file(fs::path(SEXTANT_EXAMPLE_FOLDER) / "rgbd_odometry.json"));
  RunConfig c = run_config("external:" + file("example.json").string());
  c.options = {{"estimator", {{"command", SEXTANT_EXAMPLE_PROGRAM " {input} {output}"}}}};
  last_ = run(c);
  EXPECT_THAT(last_.sources.front().problems, ElementsAre());
  EXPECT_EQ(statuses("ego"), ok4);
  EXPECT_EQ(statuses("object:1"), ok4);
  EXPECT_LT(worst("ego", "Et_m"), 0.01);
  EXPECT_LT(worst("object:1", "Et_body_m"), 0.05);
  EXPECT_EQ(last_.records.front().estimator, "example");
}

TEST_F(ExternalEstimatorTest, RecordsHaveTheKeysOfBuiltInEstimators) {
  write_camera();
  write_motions();
  const std::string noise = R"({"depth":{"delta_d_px":0.1,"baseline_m":0},"flow":{"epe_px":0.2}})";
  last_ = run_with(config("cp $(dirname $0)/camera.txt $(dirname $0)/obj_1.txt $output/", motions_), noise);
  EXPECT_THAT(last_.sources.front().problems, ElementsAre());
  const RunResult inside = run_with("joint_flow", noise);
  ASSERT_EQ(last_.records.size(), inside.records.size());
  const auto keys = [](const Record::Numbers& numbers) {
    std::set<std::string> names;
    for (const auto& [key, value] : numbers) {
      if (!key.str().starts_with("epe_") && key != "nees" && key != "condition" && key != "moving_share" &&
          key != "dynamic" && key != "peak_memory_mb")
        names.insert(key);
    }
    return names;
  };
  for (size_t i = 0; i < inside.records.size(); ++i) {
    const Record &a = last_.records[i], &b = inside.records[i];
    EXPECT_EQ(a.body, b.body);
    EXPECT_EQ(a.frame, b.frame);
    EXPECT_EQ(a.noise, b.noise);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(keys(a.errors), keys(b.errors));
    EXPECT_EQ(keys(a.values), keys(b.values));
    EXPECT_EQ(a.bound, b.bound);
    EXPECT_FALSE(a.bound.empty());
    EXPECT_LT(a.errors.at("Et_m"), 1e-9);
    if (!a.is_ego()) continue;
    EXPECT_GT(a.time_ms.at("cpu"), 0);
    EXPECT_GT(a.values.at("peak_memory_mb"), 0);
    EXPECT_FALSE(strip_times(a).values.contains("peak_memory_mb"));
  }
}

struct CameraFormat {
  std::string name;
  Json camera;
  std::function<std::string(int frame, const SE3& T_world_camera)> line;
};

TEST_F(ExternalEstimatorTest, EveryFormatOfTrajectories) {
  const auto kitti = [](const SE3& T) { return kitti_row(T); };
  const std::vector<CameraFormat> formats = {
      {"kitti with frames", Json::object(),
       [&](int k, const SE3& T) { return fmt::format("{} {}", k, kitti(T)); }},
      {"kitti by row", {{"format", "kitti"}}, [&](int, const SE3& T) { return kitti(T); }},
      {"inverse",
       {{"inverse", true}},
       [&](int k, const SE3& T) { return fmt::format("{} {}", k, kitti(T.inverse())); }},
      {"vdo",
       {{"format", "vdo"}},
       [&](int k, const SE3& T) { return fmt::format("{} {} 0 0 0 1", k, kitti(T)); }},
      {"tum",
       {{"format", "tum"}},
       [&](int k, const SE3& T) { return fmt::format("{} {}", k * 0.1, tum_row(T)); }},
      {"euroc", {{"format", "euroc"}}, [&](int k, const SE3& T) {
         const Eigen::Vector3d& t = T.translation();
         const Eigen::Quaterniond& q = T.rotation();
         return fmt::format("{},{},{},{},{},{},{},{}", k * 100'000'000LL, t.x(), t.y(), t.z(), q.w(), q.x(),
                            q.y(), q.z());
       }}};
  for (const CameraFormat& format : formats) {
    write_results("any.txt", [&](int k) { return format.line(k, own(T_world_camera(k))); });
    last_ = run_with(config("cp $(dirname $0)/any.txt $output/camera.txt", {{"camera", format.camera}}));
    EXPECT_THAT(last_.sources.front().problems, ElementsAre()) << format.name;
    EXPECT_EQ(statuses("ego"), ok4) << format.name;
    EXPECT_LT(worst("ego", "Et_m"), 1e-9) << format.name;
    EXPECT_LT(worst("ego", "ER_deg"), 1e-6) << format.name;
    EXPECT_EQ(statuses("object:1"), not_detected4) << format.name;
  }
}

TEST_F(ExternalEstimatorTest, EveryFormOfObjectMotions) {
  write_camera();
  const auto check = [&](const std::string& what, const Json& objects) {
    last_ =
        run_with(config("cp $(dirname $0)/camera.txt $(dirname $0)/obj_* $output/", {{"objects", objects}}));
    EXPECT_THAT(last_.sources.front().problems, ElementsAre()) << what;
    EXPECT_EQ(statuses("object:1"), ok4) << what;
    EXPECT_LT(worst("object:1", "Et_m"), 1e-8) << what;
    EXPECT_LT(worst("object:1", "Et_body_m"), 1e-8) << what;
    EXPECT_LT(worst("object:1", "Ev_kmh"), 1e-6) << what;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      if (entry.path().filename().string().starts_with("obj_")) fs::remove(entry.path());
    }
  };
  write_motions();
  check("world", {{"format", "motions"}});
  write_motions("obj_8.txt");
  check("another id", {{"format", "motions"}, {"id_offset", -7}});
  write_motions("obj_8.txt");
  check("any id", {{"format", "motions"}, {"ids", "overlap"}});
  const auto seen = [&](int k) { return T_world_camera(k).inverse() * T_world_object(k); };
  write_poses(
      "obj_1.txt", [&](int k) { return seen(k) * seen(k - 1).inverse(); }, 4);
  check("camera", {{"format", "motions"}, {"frame", "camera"}});
  write_poses(
      "obj_1.txt", [&](int k) { return body(k); }, 4);
  check("body", {{"format", "motions"}, {"frame", "body"}});
  write_results("obj_1.tum",
                [&](int k) { return fmt::format("{} {}", 0.1 * k, tum_row(own(T_world_object(k)))); });
  check("poses", {{"format", "poses"}, {"files", "obj_*.tum"}});
}

TEST_F(ExternalEstimatorTest, MotionsInAnotherFrameThanTheDeclaredOneAreNamed) {
  write_camera();
  const auto seen = [&](int k) { return T_world_camera(k).inverse() * T_world_object(k); };
  const std::map<std::string, std::function<SE3(int)>> frames = {
      {"world", [&](int k) { return world(k); }},
      {"camera", [&](int k) { return seen(k) * seen(k - 1).inverse(); }},
      {"body", [&](int k) { return body(k); }}};
  for (const char* ids : {"masks", "overlap"}) {
    for (const auto& [written, motion] : frames) {
      write_poses("obj_1.txt", motion, 4);
      for (const auto& [declared, other] : frames) {
        const Json objects = {{"format", "motions"}, {"frame", declared}, {"ids", ids}};
        const std::vector<std::string> problems =
            problems_of("cp $(dirname $0)/camera.txt $(dirname $0)/obj_* $output/", {{"objects", objects}});
        SCOPED_TRACE(fmt::format("{} declared as {}, ids {}", written, declared, ids));
        if (written == declared) {
          EXPECT_THAT(problems, ElementsAre());
        } else if (ids == std::string("masks") || statuses("object:1") != not_detected4) {
          EXPECT_THAT(problems, ElementsAre(HasSubstr("declare objects.frame as " + written)));
        }
      }
    }
  }
}

TEST_F(ExternalEstimatorTest, PosesByRowNeedARowForEachFrame) {
  write_camera();
  const auto pose = [&](int k) { return kitti_row(own(T_world_object(k))); };
  const std::string script = "cp $(dirname $0)/camera.txt $(dirname $0)/obj_* $output/";
  const Json poses = {{"objects", {{"format", "poses"}}}};
  write_results("obj_1.txt", pose);
  run_well(script, poses);
  EXPECT_EQ(statuses("object:1"), ok4);
  EXPECT_LT(worst("object:1", "Et_m"), 1e-8);
  write_results("obj_1.txt", pose, 4);
  EXPECT_THAT(problem_of(script, poses), HasSubstr("obj_1.txt: expected a frame number or time stamp in each "
                                                   "line of a file of poses with 4 rows for 5 frames"));
  EXPECT_EQ(statuses("object:1"), diverged4);
  // The rows of a program that failed end early.
  write_results("obj_1.txt", pose);
  EXPECT_THAT(problem_of(script + "; head -4 $(dirname $0)/obj_1.txt > $output/obj_1.txt; exit 3", poses),
              HasSubstr("exit code 3"));
  EXPECT_EQ(statuses("object:1"), (std::vector<std::string>{"ok", "ok", "ok", "lost"}));
}

TEST_F(ExternalEstimatorTest, LogsOfDynosamAndVdo) {
  const auto csv = [](std::string row) {
    std::ranges::replace(row, ' ', ',');
    return row;
  };
  const std::string identity = "0,0,0,0,0,0,1";
  write_results("m_camera_pose_log.csv", [&](int k) {
    return fmt::format("{},{},{}", k, csv(tum_row(own(T_world_camera(k)))), identity);
  });
  write_results(
      "m_object_motion_log.csv",
      [&](int k) { return fmt::format("{},1,{},{}", k, csv(tum_row(world(k))), identity); }, 4);
  run_well("cp $(dirname $0)/*.csv $output/",
           {{"camera", {{"file", "*_camera_pose_log.csv"}, {"format", "dynosam"}}},
            {"objects", {{"format", "dynosam"}}}});
  EXPECT_LT(worst("object:1", "Et_m"), 1e-8);
  EXPECT_EQ(statuses("object:1"), ok4);

  write_results("refined_0.txt",
                [&](int k) { return fmt::format("{} {} 0 0 0 1", k, kitti_row(own(T_world_camera(k)))); });
  write_results(
      "obj_mot_rgbd_new.txt", [&](int k) { return fmt::format("{} 1 {} 0 0 0 1", k, kitti_row(body(k))); },
      4);
  run_well("cp $(dirname $0)/refined_0.txt $(dirname $0)/obj_mot* $output/",
           {{"camera", {{"file", "refined_*.txt"}}}, {"objects", {{"format", "vdo"}}}});
  EXPECT_LT(worst("object:1", "Et_body_m"), 1e-8);
  EXPECT_EQ(statuses("object:1"), ok4);
}

TEST_F(ExternalEstimatorTest, ProgramsMayCountFramesFromZero) {
  write_camera("any.txt", -3);
  EXPECT_THAT(
      problem_of("cp $(dirname $0)/any.txt $output/camera.txt"),
      HasSubstr(
          "frame 0 is not among 3 to 7 of the input; if the program counts otherwise, give first_frame"));
  EXPECT_EQ(statuses("ego"), diverged4);
  problems_of("cp $(dirname $0)/any.txt $output/camera.txt", {{"first_frame", 0}});
  EXPECT_LT(worst("ego", "Et_m"), 1e-9);
}

// ---- failures

TEST_F(ExternalEstimatorTest, MissingOutputIsAProblem) {
  EXPECT_THAT(problem_of("exit 0"), HasSubstr("camera.txt: the program did not write this file"));
  EXPECT_EQ(statuses("ego"), lost4);
  EXPECT_EQ(statuses("object:1"), not_detected4);
}

TEST_F(ExternalEstimatorTest, Garbage) {
  EXPECT_THAT(problem_of("printf '3 1 2 nonsense\\n' > $output/camera.txt"), HasSubstr("camera.txt"));
  EXPECT_EQ(statuses("ego"), diverged4);
  EXPECT_THAT(problem_of("head -c 3000 /dev/urandom > $output/camera.txt"), HasSubstr("camera.txt"));
  EXPECT_EQ(statuses("ego"), diverged4);
  EXPECT_THAT(problem_of("printf '0.3 0 0 0 0 0 0 1\\n0.4 0 0 nan 0 0 0 1\\n' > $output/camera.txt"),
              HasSubstr("camera.txt:2: value 4 is 'nan'"));
  write_camera();
  EXPECT_THAT(problem_of("cp $(dirname $0)/camera.txt $output; echo 4 what > $output/obj_1.txt", motions_),
              HasSubstr("obj_1.txt"));
  EXPECT_EQ(statuses("ego"), ok4);
  EXPECT_EQ(statuses("object:1"), diverged4);
  write_motions();
  EXPECT_THAT(problem_of("echo 4 what > $output/camera.txt; cp $(dirname $0)/obj_1.txt $output", motions_),
              HasSubstr("camera.txt"));
  EXPECT_EQ(statuses("object:1"), diverged4) << "the program named it, but its motion needs the camera";
}

TEST_F(ExternalEstimatorTest, ExitCodeAndPartialOutput) {
  write_camera();
  const std::string script =
      "head -n 3 $(dirname $0)/camera.txt > $output/camera.txt; "
      "printf '6 1 0 0' >> $output/camera.txt; exit 3";
  EXPECT_THAT(problems_of(script), ElementsAre(HasSubstr("program: exit code 3 (")));
  EXPECT_THAT(statuses("ego"), ElementsAre("ok", "ok", "lost", "lost"));
  EXPECT_LT(worst("ego", "Et_m"), 1e-9);
  EXPECT_THAT(log(), AllOf(HasSubstr("end: exit code 3"), HasSubstr("camera poses: 3 of 5 frames"),
                           HasSubstr("its last line is incomplete and was left out")));
  EXPECT_THAT(problem_of("head -n 2 $(dirname $0)/camera.txt > $output/camera.txt"),
              AllOf(HasSubstr("camera poses of 2 of 5 frames"), testing::Not(HasSubstr("rows are taken"))));
  EXPECT_THAT(
      problem_of("head -n 2 $(dirname $0)/camera.txt | cut -d' ' -f2- > $output/camera.txt"),
      AllOf(HasSubstr("camera poses of 2 of 5 frames"), HasSubstr("rows are taken as the first 2 frames")));
}

TEST_F(ExternalEstimatorTest, AnObjectThatIsMissingInSomeFrames) {
  write_camera();
  write_motions("obj_1.txt", 6);
  problems_of("cp $(dirname $0)/camera.txt $(dirname $0)/obj_1.txt $output/", motions_);
  EXPECT_THAT(statuses("object:1"), ElementsAre("lost", "lost", "ok", "ok"));
}

TEST_F(ExternalEstimatorTest, KilledByASignal) {
  EXPECT_THAT(last_.records, ElementsAre());
  problems_of("kill -SEGV $$");
  EXPECT_THAT(last_.sources.front().problems.front(), HasSubstr("signal 11 (Segmentation fault)"));
  EXPECT_EQ(statuses("ego"), lost4);
}

TEST_F(ExternalEstimatorTest, AHangingProgramIsKilledWithAllThatItStarted) {
  // On a slow machine the first limits may expire before the program has begun.
  const fs::path pid_file = case_folder() / "output" / "pid";
  for (double limit_s = 0.3; !fs::exists(pid_file) || fs::file_size(pid_file) == 0; limit_s *= 4)
    problems_of("trap '' TERM; sleep 6000 & echo $! > $output/pid; wait; sleep 6000",
                {{"time_limit_s", limit_s}});
  EXPECT_THAT(last_.sources.front().problems.front(), HasSubstr("killed at the time limit"));
  EXPECT_EQ(statuses("ego"), lost4);
  const int pid = std::stoi(read_file(pid_file));
  // Gone, or dead and not yet collected by its new parent.
  const fs::path stat = fs::path("/proc") / std::to_string(pid) / "stat";
  if (fs::exists(stat)) {
    std::ifstream in(stat);
    std::string line;
    std::getline(in, line);
    EXPECT_THAT(line, HasSubstr(") Z ")) << "still runs";
  }
}

TEST_F(ExternalEstimatorTest, StdoutAndStderrAreKept) {
  problem_of("echo hello; echo wrong >&2");
  EXPECT_EQ(output_of_program(), "hello\n");
  EXPECT_EQ(read_file(case_folder() / "stderr.txt"), "wrong\n");
}

TEST_F(ExternalEstimatorTest, AProgramThatCannotBeStarted) {
  write_file(file("none.json"), R"({"command": "./no_such_program {input}"})");
  expect_error([&] { run_with("external:" + file("none.json").string()); },
               "cannot start './no_such_program'");
}

TEST_F(ExternalEstimatorTest, EnvironmentAndWorkingDirectory) {
  problem_of("echo \"$A|$PATH\"; pwd",
             {{"environment", "A='two words' B={n}"}, {"working_directory", "{output}"}});
  EXPECT_THAT(output_of_program(), AllOf(StartsWith("two words|/"), HasSubstr("seed0/output\n")));
}

// ---- the input

TEST_F(ExternalEstimatorTest, InputHoldsTheNoiseOfTheCaseAndNoTruth) {
  const std::string noise = R"({"depth":{"delta_d_px":0.2},"flow":{"epe_px":0.5},"mask":{"erode_px":1}})";
  run_with(config("exit 0", {{"keep", "all"}}), noise, 2);
  const fs::path input = file("logs") / "vdo_data_3-7_seed1" / "input";
  for (const auto& [name, bytes] : files_below(input)) EXPECT_THAT(name, Not(HasSubstr("pose")));
  const auto written = open_source(SourceSpec::parse("vdo:" + input.string()));
  const Channels channels{.depth = true, .flow = true, .mask = true};
  const Draws draws(1, sequence_->info().dataset, sequence_->info().sequence);
  const Frame expected =
      Noise::parse(noise).apply(sequence_->read(5, channels), sequence_->info().camera, draws).frame;
  const Frame got = written->read(5, channels);
  EXPECT_EQ(got.mask, expected.mask);
  int n = 0;
  for (size_t i = 0; i < got.flow.size(); ++i) {
    EXPECT_EQ(got.flow.data()[i].u, expected.flow.data()[i].u);
    const double bf = sequence_->info().camera.bf;
    const float z = expected.depth_m.data()[i];
    if (!std::isfinite(z) || bf / z > 255) continue;
    EXPECT_NEAR(bf / got.depth_m.data()[i], bf / z, 1.01 / 512);
    ++n;
  }
  EXPECT_GT(n, 1000);
  EXPECT_NE(got.flow.data()[5000].u, sequence_->read(5, channels).flow.data()[5000].u);
}

TEST_F(ExternalEstimatorTest, EveryLayout) {
  const auto files = [&](const std::string& layout, bool truth) {
    problems_of("echo $4; find $input -type f | sort | sed \"s|$input/||\"",
                {{"layout", layout}, {"write_truth", truth}});
    return output_of_program();
  };
  EXPECT_THAT(files("vdo", false), HasSubstr("semantic/000007.txt"));
  EXPECT_THAT(files("vdo", false), Not(HasSubstr("pose_gt.txt")));
  EXPECT_THAT(files("vdo", true), HasSubstr("pose_gt.txt"));
  EXPECT_THAT(files("kitti", false), HasSubstr("training/image_02/0000/000004.png"));
  EXPECT_THAT(files("kitti", false), Not(HasSubstr("oxts")));
  EXPECT_THAT(files("vkitti2", false), HasSubstr("Scene00/clone/frames/depth/Camera_0/depth_00003.png"));
}

// ---- sweeps

class ExternalSweepTest : public ExternalEstimatorTest {
 protected:
  std::string untimed_bytes(const std::string& out) const {
    return write_records(untimed(read_records(file(out) / "records.jsonl")));
  }
};

TEST_F(ExternalSweepTest, GoesOnAfterCasesThatFail) {
  write_camera();
  const std::string estimator = config(
      "case $seed in 0) cp $(dirname $0)/camera.txt $output;; 1) exit 7;; 2) "
      "echo garbage > $output/camera.txt;; esac");
  const SweepOutcome outcome = sweep(sweep_config("a", estimator));
  EXPECT_EQ(outcome.n_cases, 12U);
  ASSERT_EQ(outcome.problems.size(), 6U);  // 2 levels x (exit code, its missing file, garbage)
  EXPECT_THAT(outcome.problems[0], HasSubstr("exit code 7"));
  EXPECT_THAT(outcome.problems[0], HasSubstr("case_000001/log.txt"));
  EXPECT_THAT(outcome.problems[2], HasSubstr("camera.txt"));
  std::map<std::string, std::set<std::string>> by_seed;
  for (const Record& record : read_records(file("a") / "records.jsonl")) {
    if (record.is_ego())
      by_seed[fmt::format("{} {}", record.estimator, record.seed)].emplace(to_string(record.status));
  }
  EXPECT_THAT(by_seed["program 0"], ElementsAre("ok"));
  EXPECT_THAT(by_seed["program 1"], ElementsAre("lost"));
  EXPECT_THAT(by_seed["program 2"], ElementsAre("diverged"));
  EXPECT_THAT(by_seed["motion_only 1"], ElementsAre("ok"));
}

TEST_F(ExternalSweepTest, BytesDoNotDependOnJobs) {
  write_camera();
  const std::string estimator = config("cp $(dirname $0)/camera.txt $output");
  sweep(sweep_config("a", estimator));
  sweep(sweep_config("b", estimator, 3, 2));
  EXPECT_EQ(untimed_bytes("a"), untimed_bytes("b"));
}

TEST_F(ExternalSweepTest, ConfigurationsLieBesideThePlan) {
  config("exit 0");
  EXPECT_EQ(sweep_config("a", "external:program.json").plan.estimators.front().label, "program");
}

// ---- configurations

TEST_F(ExternalEstimatorTest, ConfigurationsAreReadStrictly) {
  const auto open = [&](const std::string& json) {
    write_file(file("c.json"), json);
    make_case_estimator("external:" + file("c.json").string());
  };
  expect_error([&] { open("{\"command\": \"a\",\n \"layuot\": 1}"); },
               "unknown option key 'layuot': did you mean 'layout'");
  expect_error([&] { open("{\"command\": \"a\",\n oops}"); }, "c.json:2: not valid JSON");
  expect_error([&] { open("{}"); }, "command");
  expect_error([&] { open(R"({"command": "a {inptu}"})"); },
               "unknown placeholder {inptu}: did you mean 'input'");
  expect_error([&] { open(R"({"command": "a 'b"})"); }, "is not closed");
  expect_error([&] { open(R"({"command": "a", "layout": "vdoo"})"); }, "did you mean 'vdo'");
  expect_error([&] { open(R"({"command": "a", "time_limit_s": 0})"); }, "time_limit_s");
  expect_error([&] { open(R"({"command": "a", "environment": "B"})"); }, "NAME=VALUE");
  expect_error([&] { open(R"({"command": "a", "objects": {"format": "tum"}})"); }, "objects.format");
  expect_error([&] { open(R"({"command": "a", "objects": {"files": "obj.txt"}})"); }, "with one *");
  expect_error([&] { open(R"({"command": "a", "camera": {"format": "tumm"}})"); }, "did you mean 'tum'");
  expect_error([] { make_case_estimator("external:/no/such.json"); }, "/no/such.json");
  expect_error([] { make_case_estimator("extrenal:a.json"); }, "external:CONFIG.json");
}

TEST(ExternalConfig, WordsAreSplitAsInAShell) {
  const Placeholders values = {{"input", "/a b/c"}};
  EXPECT_THAT(words_of(" run  --in {input} 'x y' \"it's\" a'b c'd '' ", values),
              ElementsAre("run", "--in", "/a b/c", "x y", "it's", "ab cd", ""));
}

}  // namespace
}  // namespace sextant
