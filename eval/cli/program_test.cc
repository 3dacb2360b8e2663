// Starts the program as a user does and looks at exit code, output and what is left on disk.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>

#include "sextant/base/files.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/experiment/record.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct Outcome {
  int code = -1;
  std::string out;
  std::string err;
};

Outcome sextant_program(const std::string& arguments) {
  const TempFolder temp;
  const std::string out = (temp.path() / "out").string(), err = (temp.path() / "err").string();
  const std::string command = fmt::format("{} {} > {} 2> {}", SEXTANT_PROGRAM, arguments, out, err);
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(out), read_file(err)};
}

/// Exit code 2 and exactly one line on stderr that names `named`.
void expect_bad_input(const Outcome& outcome, const std::string& named) {
  EXPECT_EQ(outcome.code, 2) << outcome.err;
  EXPECT_TRUE(outcome.err.starts_with("sextant: error: ")) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(named));
}

class ProgramOnFixture : public testing::Test {
 protected:
  ProgramOnFixture() {
    VdoFixtureOptions options;
    options.width = 160;
    options.height = 48;
    fixture_ = make_vdo_fixture(temp_.path() / "vdo", options);
  }

  fs::path file(const std::string& name) const { return fixture_.dir / name; }
  fs::path out() const { return temp_.path() / "results"; }

  Outcome run(const std::string& more = "", const std::string& range = "") const {
    return sextant_program(
        fmt::format("run {}{} --out {} --jobs 2 {}", fixture_.source(), range, out().string(), more));
  }

  void expect_refused(const std::string& named, const std::string& more = "",
                      const std::string& range = "") const {
    expect_bad_input(run(more, range), named);
    EXPECT_FALSE(fs::exists(out()));
  }

  TempFolder temp_;
  VdoFixture fixture_;
};

TEST_F(ProgramOnFixture, RunWritesACompleteFolder) {
  const Outcome outcome = run();
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("preset paper"));
  EXPECT_TRUE(outcome.out.ends_with("Results: " + out().string() + "\n")) << outcome.out;
  EXPECT_GE(read_records(out() / "records.jsonl").size(), 4U);
  EXPECT_TRUE(Json::accept(read_file(out() / "run.json")));
  for (const char* name : {"summary.md", "summary.csv", "est_camera_kitti.txt", "est_camera_tum.txt"}) {
    EXPECT_TRUE(fs::exists(out() / name)) << name;
  }
  EXPECT_EQ(run().code, 0);  // the same run again
  expect_bad_input(run("--estimator motion_only"), "--force");
  EXPECT_EQ(run("--estimator motion_only --force").code, 0);
}

TEST_F(ProgramOnFixture, RunPrintsJson) {
  const Outcome outcome = run("--json --quiet");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["preset"], "paper");
  EXPECT_EQ(json["rows"][0]["body"], "ego");
}

TEST_F(ProgramOnFixture, RelativeSourcesAreFoundInTheDataRoot) {
  const std::string arguments =
      fmt::format("run vdo:vdo@0-1 --data {} --out {}", temp_.path().string(), out().string());
  EXPECT_EQ(sextant_program(arguments).code, 0);
}

TEST_F(ProgramOnFixture, DataCheckPassesAndFails) {
  EXPECT_EQ(sextant_program("data check " + fixture_.source()).code, 0);
  const Outcome json = sextant_program("data check --json " + fixture_.source());
  EXPECT_EQ(Json::parse(json.out)["failed"], 0);
  const std::string good = read_file(file("depth/000002.png"));
  write_file(file("depth/000002.png"), good.substr(0, good.size() / 2));
  const Outcome outcome = sextant_program("data check " + fixture_.source());
  expect_bad_input(outcome, "000002.png");
  EXPECT_THAT(outcome.out, HasSubstr("FAIL  depth"));
}

TEST_F(ProgramOnFixture, OverlayDrawsAPicture) {
  const std::string picture = (temp_.path() / "o.png").string();
  EXPECT_EQ(sextant_program(fmt::format("overlay {} --frame 2 --out {}", fixture_.source(), picture)).code,
            0);
  EXPECT_TRUE(read_file(picture).starts_with("\x89PNG"));
  expect_bad_input(sextant_program(fmt::format("overlay {} --frame 0 --out {}", fixture_.source(), picture)),
                   "frame 0: must be in 1-4");
}

TEST_F(ProgramOnFixture, RefusesMissingFiles) {
  for (const char* name :
       {"depth/000002.png", "flow/000002.flo", "semantic/000002.txt", "image_0/000002.png"}) {
    const std::string good = read_file(file(name));
    fs::remove(file(name));
    expect_refused(fs::path(name).parent_path().string());
    write_file(file(name), good);
  }
}

TEST_F(ProgramOnFixture, RefusesBrokenFiles) {
  const auto with = [&](const std::string& name, auto change) {
    const std::string good = read_file(file(name));
    std::string bad = good;
    change(bad);
    write_file(file(name), bad);
    expect_refused(fs::path(name).filename().string());
    write_file(file(name), good);
  };
  with("depth/000002.png", [](std::string& s) { s.resize(s.size() / 2); });
  with("image_0/000001.png", [](std::string& s) { s.resize(40); });
  with("flow/000001.flo", [](std::string& s) { s[0] = 'X'; });
  with("flow/000001.flo", [](std::string& s) { s.resize(s.size() - 8); });
  with("flow/000001.flo", [](std::string& s) { s[4] = 17; });
  with("semantic/000003.txt", [](std::string& s) { s.resize(s.find('\n') + 1); });
  with("semantic/000003.txt", [](std::string& s) { s[0] = 'x'; });
  with("pose_gt.txt", [](std::string& s) { s.erase(s.find('\n')).erase(s.rfind(' ')).append("\n"); });
  with("pose_gt.txt", [](std::string& s) { s.replace(s.find(' ') + 1, 1, "nan "); });
}

TEST_F(ProgramOnFixture, RefusesWrongRequests) {
  expect_refused("0-99", "", "@0-99");
  expect_refused("did you mean 'joint_flow'", "--estimator joint_flo");
  expect_refused("pipeline.max_distance", "--set pipeline.max_distance=3");
  expect_refused("must be > 0", "--set pipeline.max_object_distance_m=-1");
  expect_refused("estimator.sigma", "--options '{\"estimator\":{\"sigma\":1}}'");
  expect_refused("did you mean 'paper'", "--preset papr");
  expect_refused("did you mean 'depth'", "--noise '{\"dept\":{\"delta_d_px\":0.1}}'");
  expect_refused("--seeds", "--seeds 0");
  expect_refused("--jobs", "--jobs 0");
  expect_refused("not valid JSON", "--options {x");
}

TEST(Program, RefusesBadUsageInOneLine) {
  const TempFolder temp;
  const std::string out = (temp.path() / "results").string();
  expect_bad_input(sextant_program("run vdo:" + (temp.path() / "none").string() + " --out " + out), "none");
  EXPECT_FALSE(fs::exists(out));
  expect_bad_input(sextant_program(""), "a command is missing");
  expect_bad_input(sextant_program("rnu"), "did you mean 'run'");
  expect_bad_input(sextant_program("data chek"), "did you mean 'check'");
  expect_bad_input(sextant_program("run --outt x y"), "did you mean '--out'");
  expect_bad_input(sextant_program("run nowhere --out " + out), "nowhere");
}

TEST(Program, EveryHelpHasAnExample) {
  for (const char* command : {"", "run", "data", "data list", "data check", "overlay", "options"}) {
    const Outcome outcome = sextant_program(std::string(command) + " --help");
    EXPECT_EQ(outcome.code, 0) << command;
    EXPECT_THAT(outcome.out, HasSubstr("Example")) << command;
  }
  EXPECT_THAT(sextant_program("--version").out, HasSubstr("sextant 0."));
  EXPECT_THAT(sextant_program("data list").out, HasSubstr("vdo"));
  EXPECT_THAT(sextant_program("options").out, HasSubstr("estimator.sigma_flow_px"));
}

}  // namespace
}  // namespace sextant
