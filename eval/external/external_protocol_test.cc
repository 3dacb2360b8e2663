// Behaviour of real systems: several stages in one folder, frames from 0, settings files, stray and damaged
// files.

#include <algorithm>
#include <regex>
#include <set>

#include "sextant/base/error.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/external/external_case.h"
#include "sextant/eval/external/external_estimator.h"
#include "sextant/eval/external/external_testing.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/run_summary.h"

namespace sextant {
namespace {

class ExternalProtocolTest : public ExternalEstimatorTest {
 protected:
  /// Writes the true motion of camera and object 1 to camera.txt and obj_1.txt.
  void write_right_results() const {
    write_camera();
    write_motions();
  }
  static constexpr const char* copy_results = "cp $(dirname $0)/camera.txt $(dirname $0)/obj_*.txt $output/";
};

// ---- VDO-SLAM's folder

TEST_F(ExternalProtocolTest, VdoFolderOfBothStages) {
  write_vdo_results();
  const std::string copy = "cp $(dirname $0)/vdo/* $output/";
  EXPECT_THAT(problem_of(copy, {{"camera", {{"file", "refined_*.txt"}}}, {"objects", {{"format", "vdo"}}}}),
              AllOf(HasSubstr("motions of two stages, obj_mot_stereo_new.txt (initial) "
                              "and obj_mot_stereo_rf_new.txt (refined)"),
                    HasSubstr("choose one")));
  run_well(copy, vdo_set("refined"));
  EXPECT_LT(worst("ego", "Et_m"), 1e-9);
  EXPECT_LT(worst("object:1", "Et_body_m"), 1e-8);
  run_well(copy, vdo_set("initial"));
  EXPECT_NEAR(worst("object:1", "Et_body_m"), 0.1, 0.11);
  EXPECT_GT(worst("object:1", "Et_body_m"), 0.01);
  EXPECT_GT(worst("ego", "Et_m"), 0.09);
}

TEST_F(ExternalProtocolTest, VdoLabelsMatchedByOverlap) {
  write_vdo_results(7);  // its own track numbers
  run_well("cp $(dirname $0)/vdo/* $output/", vdo_set("refined", "overlap"));
  EXPECT_EQ(statuses("object:1"), ok4);
  EXPECT_LT(worst("object:1", "Et_body_m"), 1e-8);
}

TEST_F(ExternalProtocolTest, SeveralResultsOfOneRun) {
  write_vdo_results();
  const std::string script = "cp $(dirname $0)/vdo/* $output/; echo ran >> $(dirname $0)/runs";
  problems_of(script, {{"results", {{"initial", vdo_set("initial")}, {"refined", vdo_set("refined")}}}});
  EXPECT_EQ(read_file(file("runs")), "ran\n");
  EXPECT_THAT(last_.sources.front().problems, ElementsAre());
  std::map<std::string, std::pair<int, double>> by_label;  // records of the camera, largest error
  for (const Record& record : last_.records) {
    if (!record.is_ego()) continue;
    auto& [n, worst] = by_label[record.estimator];
    ++n;
    worst = std::max(worst, record.errors.at("Et_m"));
  }
  ASSERT_EQ(by_label.size(), 2U);
  EXPECT_EQ(by_label["program.initial"].first, 4);
  EXPECT_GT(by_label["program.initial"].second, 0.09);
  EXPECT_EQ(by_label["program.refined"].first, 4);
  EXPECT_LT(by_label["program.refined"].second, 1e-9);
  EXPECT_THAT(log(), AllOf(HasSubstr("results initial\n"), HasSubstr("results refined\n")));
  // A problem of one set names the set.
  Json missing = vdo_set("refined");
  missing["camera"]["file"] = "none.txt";
  EXPECT_THAT(problem_of(script, {{"results", {{"initial", vdo_set("initial")}, {"refined", missing}}}}),
              HasSubstr("program: results refined: "));
  expect_error(
      [&] {
        config("", {{"results", {{"a b", vdo_set("initial")}}}});
        run_with("external:" + file("program.json").string());
      },
      "names of letters");
}

// ---- files that are not results

TEST_F(ExternalProtocolTest, StrayFilesAreSkipped) {
  write_right_results();
  write_file(file("obj_centre.txt"), "4 1 1.5 2.5 9.5\n");
  run_well(copy_results, motions_);
  EXPECT_EQ(statuses("object:1"), ok4);
  EXPECT_THAT(log(), HasSubstr("note: " + (case_folder() / "output" / "obj_centre.txt").string() +
                               ": 'centre' in place of the * of 'obj_*.txt' is not a number: skipped"));
}

TEST_F(ExternalProtocolTest, FilesOfMatricesHaveNoQuaternions) {
  const std::string matrix = "1 0 0 0 0 1 0 0 0 0 1 0", last_row = " 0 0 0 1";
  const auto two_lines = [](const std::string& second, const std::string& values) {
    return fmt::format("0 {}\n{} {}\n", values, second, values);
  };
  const std::string tum = two_lines("0.1", "0 0 0 0 0 0 1"), kitti = two_lines("1", matrix),
                    vdo = two_lines("1", matrix + last_row);
  fs::create_directory(file("results"));
  const auto read = [&](const std::string& camera, const std::string& first, const std::string& second) {
    write_file(file("results") / "camera.txt", camera);
    write_file(file("results") / "obj_1.txt", first);
    write_file(file("results") / "obj_2.txt", second);
    ExternalResultSet set;
    set.objects.format = ObjectsFormat::motions;
    const ExternalResults results = read_external_results(
        set, {.path = file("results"), .numbers = {.first = 0, .last = 1, .rate_hz = 10}}, {});
    EXPECT_THAT(results.problems, ElementsAre());
    EXPECT_EQ(results.motions.size(), 2U);
    return std::pair(results.camera_has_quaternions, results.motions_have_quaternions);
  };
  EXPECT_EQ(read(tum, tum, tum), std::pair(true, true));
  EXPECT_EQ(read(kitti, tum, tum), std::pair(false, true));
  EXPECT_EQ(read(vdo, tum, kitti), std::pair(false, false));
  EXPECT_EQ(read(tum, vdo, vdo), std::pair(true, false));
}

TEST_F(ExternalProtocolTest, ADamagedFileAffectsOnlyItsObject) {
  write_right_results();
  write_file(file("obj_5.txt"), "4 what\n");
  EXPECT_THAT(problem_of(copy_results, motions_), HasSubstr("obj_5.txt:1: "));
  EXPECT_EQ(statuses("object:1"), ok4);
}

TEST_F(ExternalProtocolTest, TwoFilesOfOneObjectAreRefused) {
  write_right_results();
  fs::copy_file(file("obj_1.txt"), file("obj_01.txt"));
  EXPECT_THAT(
      problem_of(copy_results, motions_),
      HasSubstr("obj_1.txt: is a file of object 1, as is obj_01.txt: expected one file for each object"));
  EXPECT_EQ(statuses("object:1"), diverged4);
  Json overlap = motions_;
  overlap["objects"]["frame"] = "body";
  overlap["objects"]["ids"] = "overlap";
  EXPECT_THAT(problems_of(copy_results, overlap), ElementsAre(HasSubstr("as is obj_01.txt")));
  EXPECT_THAT(statuses("object:1"), Not(Contains("ok")));
}

TEST_F(ExternalProtocolTest, IdsOutOfRange) {
  write_right_results();
  const auto with = [&](const std::string& id, int offset) {
    fs::copy_file(file("obj_1.txt"), file("obj_" + id + ".txt"));
    const std::string problem =
        problem_of(fmt::format("cp $(dirname $0)/camera.txt $(dirname $0)/obj_{}.txt $output/", id),
                   {{"objects", {{"format", "motions"}, {"id_offset", offset}}}});
    for (const Record& record : last_.records) EXPECT_THAT(record.body, Not(HasSubstr("-")));
    // The reader of `report`.
    write_file(file("records.jsonl"), write_records(last_.records));
    EXPECT_EQ(read_records(file("records.jsonl")).size(), last_.records.size());
    EXPECT_FALSE(summarize(last_.records, find_preset("paper")).empty());
    fs::remove(file("obj_" + id + ".txt"));
    return problem;
  };
  EXPECT_THAT(with("-1", 0),
              HasSubstr("object -1 with id_offset 0 is left out: expected an id from 1 to 1000000000"));
  EXPECT_THAT(with("0", 0), HasSubstr("object 0 with id_offset 0"));
  EXPECT_THAT(with("2000000000", 2'000'000'000), HasSubstr("expected an id from 1 to 1000000000"));
  EXPECT_THAT(with("99999999999999999999", 1), HasSubstr("expected an id from 1 to 1000000000"));
  EXPECT_THAT(with("7", -2'000'000'000), HasSubstr("expected an id from 1 to 1000000000"));
}

TEST_F(ExternalProtocolTest, LinksThatLeaveTheOutputAreIgnored) {
  write_right_results();
  // no end of line after the last line
  const std::string precious = read_file(file("camera.txt")) + "8 1 0 0";
  write_file(file("precious.txt"), precious);
  problems_of(
      "ln -s $(dirname $0)/precious.txt $output/camera.txt\n"
      "ln -s $(dirname $0) $output/sub\nexit 3",
      motions_);
  EXPECT_EQ(read_file(file("precious.txt")), precious);
  EXPECT_EQ(statuses("ego"), lost4);
  EXPECT_THAT(log(), HasSubstr("camera.txt: leads to a file outside {output}: ignored"));
  problems_of("ln -s $(dirname $0) $output/sub; exit 0", {{"camera", {{"file", "sub/camera.txt"}}}});
  EXPECT_EQ(statuses("ego"), lost4);
  // The folder itself.
  problems_of(
      "rmdir $output; mkdir $(dirname $0)/away; "
      "cp $(dirname $0)/camera.txt $(dirname $0)/away; ln -s $(dirname $0)/away $output");
  EXPECT_EQ(statuses("ego"), lost4);
  // Links inside the folder count as files.
  problems_of("cp $(dirname $0)/camera.txt $output/pose.txt; ln -s pose.txt $output/camera.txt");
  EXPECT_EQ(statuses("ego"), ok4);
}

TEST_F(ExternalProtocolTest, OutputsOfAProgramAreNotModified) {
  write_vdo_results();
  const std::string cut = "7 1 0 0";
  EXPECT_THAT(problem_of("cp $(dirname $0)/vdo/* $output/\n"
                         "for f in $output/*; do head -n 3 $f > x; printf '" +
                             cut +
                             "' >> x; cp x $f; done\n"
                             "printf 'no end' > $output/other.bin; exit 3",
                         vdo_set("refined")),
              HasSubstr("exit code 3"));
  EXPECT_THAT(statuses("ego"), ElementsAre("ok", "ok", "lost", "lost"));
  EXPECT_THAT(statuses("object:1"), ElementsAre("ok", "ok", "lost", "lost"));
  EXPECT_LT(worst("object:1", "Et_body_m"), 1e-8);
  for (const auto& entry : fs::directory_iterator(case_folder() / "output")) {
    const std::string text = read_file(entry.path());
    EXPECT_TRUE(text.ends_with(cut) || text == "no end") << entry.path();
  }
  EXPECT_THAT(log(), HasSubstr("its last line is incomplete and was left out"));
}

TEST_F(ExternalProtocolTest, HugeFilesAreRefusedUnread) {
  EXPECT_THAT(problem_of("truncate -s 60G $output/camera.txt"),
              HasSubstr("camera.txt: has 64.4 GB, expected at most 0.10 GB for a file of poses or times"));
  EXPECT_EQ(statuses("ego"), diverged4);
  write_right_results();
  problems_of("cp $(dirname $0)/camera.txt $output; truncate -s 60G $output/obj_1.txt; exit 3", motions_);
  EXPECT_THAT(last_.sources.front().problems.at(1), HasSubstr("obj_1.txt: has 64.4 GB"));
  EXPECT_EQ(statuses("ego"), ok4);
  EXPECT_EQ(statuses("object:1"), diverged4);
  // A file that no option names is not read, nor is a log of another kind.
  write_vdo_results();
  problems_of("cp $(dirname $0)/vdo/* $output; truncate -s 60G $output/map.bin; exit 3", vdo_set("refined"));
  EXPECT_EQ(statuses("object:1"), ok4);
  EXPECT_THAT(problem_of("cp $(dirname $0)/vdo/* $output; truncate -s 60G $output/obj_mot_stereo_rf_new.txt",
                         vdo_set("refined")),
              HasSubstr("expected at most 1.00 GB for a log"));
  EXPECT_THAT(problem_of("cp $(dirname $0)/camera.txt $output; truncate -s 60G $output/ms.txt",
                         {{"times", {{"file", "ms.txt"}}}}),
              HasSubstr("ms.txt: has 64.4 GB"));
}

// ---- the input

TEST_F(ExternalProtocolTest, FramesFromZero) {
  write_camera("any.txt", -3);
  write_motions("obj_1.txt", 4, -3);
  run_well(
      "cp $(dirname $0)/any.txt $output/camera.txt; cp $(dirname $0)/obj_1.txt $output\n"
      "cd $input; ls image_0; cat times.txt; cut -d' ' -f1 pose_gt.txt",
      {{"renumber", true}, {"write_truth", true}, {"objects", {{"format", "motions"}}}});
  EXPECT_EQ(output_of_program(),
            "000000.png\n000001.png\n000002.png\n000003.png\n000004.png\n"
            "0.000000000\n0.100000000\n0.200000000\n0.300000000\n0.400000000\n0\n1\n2\n3\n4\n");
  EXPECT_LT(worst("ego", "Et_m"), 1e-9);
  EXPECT_LT(worst("object:1", "Et_m"), 1e-8);
  EXPECT_EQ(last_.records.front().frame, 4) << "records keep the source's numbers";
  // The noise is that of the same frames.
  const std::string noise = R"({"depth":{"delta_d_px":0.2},"flow":{"epe_px":0.5}})";
  const auto sums = [&](bool renumber) {
    run_with(config("cd $input; cat depth/*.png flow/*.flo | sha256sum", {{"renumber", renumber}}), noise);
    return output_of_program();
  };
  EXPECT_EQ(sums(true), sums(false));
}

TEST_F(ExternalProtocolTest, FlowOfTheLastFrame) {
  const auto files = [&](const Json& more) {
    run_with(config("ls $input/flow", more));
    return output_of_program();
  };
  EXPECT_EQ(files({}), "000003.flo\n000004.flo\n000005.flo\n000006.flo\n");
  EXPECT_EQ(files({{"last_flow", "zero"}, {"keep", "all"}}),
            "000003.flo\n000004.flo\n000005.flo\n000006.flo\n000007.flo\n");
  const fs::path last = case_folder() / "input" / "flow" / "000007.flo";
  const Image<Flow> flow = decode_flo(read_file(last), last.string());
  ASSERT_EQ(flow.width(), 320);
  for (size_t i = 0; i < flow.size(); ++i) {
    ASSERT_EQ(flow.data()[i].u, 0);
    ASSERT_EQ(flow.data()[i].v, 0);
  }
  const std::string noise = R"({"flow":{"epe_px":0.5}})";
  run_with(config("ls $input/flow", {{"last_flow", "zero"}}), noise);
  EXPECT_THAT(output_of_program(), HasSubstr("000007.flo"));
}

TEST_F(ExternalProtocolTest, SettingsTemplate) {
  write_file(file("my.yaml"),
             "%YAML:1.0\nCamera.fx: {fx}\nCamera.fps: {rate}\nimages: \"{input}/image_0\"\n"
             "matrix: {rows: 3, data: [1, {width}]}\nempty: {}\nOther: {Camera}\n");
  const auto with_settings = [&](const std::string& name) {
    write_file(file("program.sh"), "cat $1\n");
    write_file(file("program.json"),
               Json{{"command", "sh {config}/program.sh {settings}"}, {"settings", name}}.dump());
    return run_with("external:" + file("program.json").string());
  };
  with_settings("my.yaml");
  const double fx = fixture_.camera.left.fx;
  EXPECT_EQ(output_of_program(),
            fmt::format("%YAML:1.0\nCamera.fx: {}\nCamera.fps: 10\nimages: \"{}/image_0\"\n"
                        "matrix: {{rows: 3, data: [1, 320]}}\nempty: {{}}\nOther: {{Camera}}\n",
                        fx, (case_folder() / "input").string()));
  EXPECT_TRUE(fs::exists(case_folder() / "settings.yaml"));
  write_file(file("bad.yaml"), "a: 1\nb: {widht}\n");
  expect_error([&] { with_settings("bad.yaml"); },
               "bad.yaml: 'b: {widht}': unknown placeholder {widht}: did you mean 'width'");
  expect_error([&] { with_settings("none.yaml"); }, "none.yaml: cannot open");
  write_file(file("program.json"), R"({"command": "sh {settings}"})");
  expect_error([&] { run_with("external:" + file("program.json").string()); },
               "unknown placeholder {settings}");
}

// ---- costs

TEST_F(ExternalProtocolTest, TimesOfTheProgram) {
  write_camera();
  const auto times = [&](const std::string& text, const Json& how) {
    write_file(file("ms.txt"), text);
    problems_of("cp $(dirname $0)/camera.txt $(dirname $0)/ms.txt $output", {{"times", how}});
    std::vector<double> ms;
    for (const Record& record : last_.records) {
      if (record.is_ego())
        ms.push_back(record.time_ms.contains("program") ? record.time_ms.at("program") : -1);
    }
    return ms;
  };
  EXPECT_THAT(times("10\n11\n12\n13\n14\n", {{"file", "ms.txt"}}), ElementsAre(11, 12, 13, 14));
  EXPECT_THAT(last_.sources.front().problems, ElementsAre());
  EXPECT_THAT(times("11\n12\n13\n14\n", {{"file", "ms.txt"}}), ElementsAre(12, 13, 14, -1));
  EXPECT_THAT(last_.sources.front().problems,
              ElementsAre(AllOf(HasSubstr("times of 4 of 5 frames"), HasSubstr("has no frame numbers"))));
  EXPECT_THAT(times("5 0.25\n7 0.5\n", {{"file", "ms.txt"}, {"unit", "s"}}), ElementsAre(-1, 250, -1, 500));
  EXPECT_THAT(times("10\n-11\n", {{"file", "ms.txt"}}), ElementsAre(-1, -1, -1, -1));
  EXPECT_THAT(last_.sources.front().problems,
              ElementsAre(HasSubstr("ms.txt:2: expected the time of a frame")));
  EXPECT_THAT(times("5 1e308\n", {{"file", "ms.txt"}, {"unit", "s"}}), ElementsAre(-1, -1, -1, -1));
  EXPECT_THAT(last_.sources.front().problems, ElementsAre(HasSubstr("in s, 0 to 1e+06")));
  EXPECT_THAT(times("", {{"file", "no.txt"}}), ElementsAre(-1, -1, -1, -1));
  EXPECT_THAT(last_.sources.front().problems, ElementsAre(HasSubstr("no.txt: the program did not write")));
  EXPECT_EQ(statuses("ego"), ok4);
  EXPECT_THAT(times("20 10\n", {{"file", "ms.txt"}}), ElementsAre(-1, -1, -1, -1));
  EXPECT_THAT(last_.sources.front().problems, ElementsAre(HasSubstr("frame 20 is not among 3 to 7")));
}

TEST_F(ExternalProtocolTest, TheLastLineOfStderrIsInTheMessage) {
  EXPECT_THAT(last_.records, ElementsAre());
  problems_of("echo first >&2; printf 'cannot open vocabulary\\r\\n\\n  \\n' >&2; exit 3");
  EXPECT_THAT(last_.sources.front().problems.front(),
              HasSubstr("exit code 3, stderr ends \"cannot open vocabulary\" ("));
  EXPECT_THAT(log(), HasSubstr("stderr ends"));
  problems_of("head -c 3000 /dev/zero | tr '\\0' x >&2; printf '\\033[31mred' >&2; exit 3");
  EXPECT_THAT(last_.sources.front().problems.front(), AllOf(HasSubstr("...xxx"), HasSubstr("?[31mred\"")));
  EXPECT_LT(last_.sources.front().problems.front().size(), 500U);
}

// ---- the documentation

/// The block of docs/external-estimators.md with the written files equals the files that are written.
TEST_F(ExternalProtocolTest, TheListingInTheDocumentIsTrue) {
  const std::string text = read_file(fs::path(SEXTANT_DOCS_FOLDER) / "external-estimators.md");
  const size_t begin = text.find("external/synthetic_s18_0-2_seed0\n");
  ASSERT_NE(begin, std::string::npos);
  std::set<std::string> listed;
  std::istringstream lines(text.substr(begin, text.find("```", begin) - begin));
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (std::regex_match(line, found, std::regex("  (\\S+)(  .*)?"))) listed.insert(found[1]);
  }
  fixture_ = make_vdo_fixture(file("small"), {.n_frames = 3});
  write_file(file("template.yaml"), "fx: {fx}\n");
  run_with(
      config(": > $output/camera.txt; : > $output/obj_1.txt",
             {{"keep", "all"}, {"write_truth", true}, {"last_flow", "zero"}, {"settings", "template.yaml"}}));
  std::set<std::string> written;
  const fs::path folder = file("logs") / "vdo_small_0-2_seed0";
  for (const auto& [name, bytes] : files_below(folder)) written.insert(name);
  EXPECT_EQ(listed, written);
}

}  // namespace
}  // namespace sextant
