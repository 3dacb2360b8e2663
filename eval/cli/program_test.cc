// Starts the program as a user does, and checks exit code, output and written files.

#include <sys/wait.h>

#include <cstdlib>
#include <map>
#include <regex>

#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/eval/cli/testing.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

class ProgramOnFixture : public testing::Test {
 protected:
  ProgramOnFixture() { fixture_ = make_vdo_fixture(temp_.path() / "vdo", {.width = 160, .height = 48}); }

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

TEST_F(ProgramOnFixture, WhatOptionsListsCanBeSetNoiseToo) {
  const auto configuration = [&](const std::string& flags) {
    EXPECT_EQ(run("--force " + flags).code, 0) << flags;
    return read_json(out() / "run.json").at("configuration");
  };
  const Json as_json = configuration(R"(--noise '{"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 1}}')");
  EXPECT_EQ(configuration(R"(--noise '{"flow": {"epe_px": 1}}' --set noise.depth.delta_d_px=0.2)"), as_json);
  EXPECT_EQ(configuration("--set noise.depth.delta_d_px=0.2 --set noise.flow.epe_px=1"), as_json);
  expect_bad_input(run("--set noise.depth.delta=1"), "unknown option key 'noise.depth.delta'");
  expect_bad_input(run("--set pipeline.refine_on=reselect"), "did you mean 'reselected'?");
}

TEST_F(ProgramOnFixture, NoiseThatChangesNothingIsNamed) {
  const std::string start =
      "run synthetic:s18@0-1 --jobs 1 --out " + (temp_.path() / "o").string() + " --force ";
  const auto error_of = [&](const std::string& flags) { return sextant_program(start + flags).err; };
  EXPECT_EQ(error_of("--noise '{\"flow\":{\"epe_px\":1}}' --seeds 2 --level 1"), "");
  EXPECT_THAT(error_of("--set noise.flow.scale=3"), HasSubstr("changes nothing"));
  EXPECT_THAT(error_of("--noise '{\"depth\":{\"baseline_m\":2}}'"), HasSubstr("changes nothing"));
  EXPECT_THAT(error_of("--level 2"), HasSubstr("state the noise level 2"));
  EXPECT_THAT(error_of("--seeds 3"), HasSubstr("without noise 3 seeds are 3 equal runs"));
  // The scale of a profile can be set.
  EXPECT_EQ(error_of("--noise '{\"profile\":\"pwc_net_kitti03\"}' --set noise.scale=0.5"), "");
}

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

/// Path -> bytes of a run's folder, times apart.
std::map<std::string, std::string> untimed_files(const fs::path& folder) {
  static const std::regex times(R"("time_ms":\{[^}]*\}|"wall_time_s": [^,]*)");
  std::map<std::string, std::string> files = files_below(folder);
  for (auto& [name, bytes] : files) bytes = std::regex_replace(bytes, times, "");
  return files;
}

TEST_F(ProgramOnFixture, ARunThatWasKilledGoesOnToTheSameBytes) {
  const std::string source = fixture_.source(), out_of_kill = (temp_.path() / "killed").string();
  const std::string command = fmt::format(
      "run {0}@0-1 {0}@1-2 {0}@2-3 {0}@3-4 --seeds 20 --noise '{{\"depth\":{{\"delta_d_px\":0.2}}}}' --jobs "
      "1 "
      "--quiet --out ",
      source);
  ASSERT_EQ(sextant_program(command + out().string()).code, 0);
  const std::string unfinished = out_of_kill + "/unfinished.jsonl";
  // kill -9 when the first source is done
  std::system(fmt::format("{} {}{} & while kill -0 $! && [ ! -e {} ]; do :; done; kill -9 $!; wait",
                          SEXTANT_PROGRAM, command, out_of_kill, unfinished)
                  .c_str());
  EXPECT_TRUE(fs::exists(unfinished));
  EXPECT_FALSE(fs::exists(out_of_kill + "/records.jsonl"));
  const Outcome again = sextant_program(command + out_of_kill);
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(untimed_files(out_of_kill), untimed_files(out()));
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

TEST_F(ProgramOnFixture, RunNamesTheMistakesOfItsInput) {
  EXPECT_EQ(run().err, "");
  std::map<int, SE3> inverse;
  for (const auto& [k, pose] : fixture_.T_world_camera) inverse[k] = pose.inverse();
  write_file(file("pose_gt.txt"), encode_pose_text(inverse));
  const Outcome outcome = run("--force");
  EXPECT_EQ(outcome.code, 0);  // the results of the files as they are
  EXPECT_THAT(outcome.err, HasSubstr("warning: " + fixture_.source() + ": camera poses are inverted"));
  EXPECT_THAT(outcome.err, HasSubstr("`sextant data check " + fixture_.source() + "` shows the numbers"));
}

TEST(Program, NoiseFitNamesTheMistakesOfItsInput) {
  const TempFolder temp;
  const VdoFixture fixture = make_vdo_fixture(temp.path() / "vdo");
  const std::string command =
      fmt::format("noise fit {} --out {}", fixture.source(), (temp.path() / "profile.json").string());
  EXPECT_EQ(sextant_program(command).err, "");
  std::map<int, SE3> inverse;
  for (const auto& [k, pose] : fixture.T_world_camera) inverse[k] = pose.inverse();
  write_file(fixture.dir / "pose_gt.txt", encode_pose_text(inverse));
  EXPECT_THAT(sextant_program(command).err,
              AllOf(HasSubstr("camera poses are inverted"),
                    HasSubstr("the profile may describe this mistake instead of noise")));
}

TEST_F(ProgramOnFixture, OverlayDrawsAPicture) {
  const std::string picture = (temp_.path() / "o.png").string();
  EXPECT_EQ(sextant_program(fmt::format("overlay {} --frame 2 --out {}", fixture_.source(), picture)).code,
            0);
  EXPECT_TRUE(read_file(picture).starts_with("\x89PNG"));
  expect_bad_input(sextant_program(fmt::format("overlay {} --frame 0 --out {}", fixture_.source(), picture)),
                   "frame 0: expected a frame from 1 to 4");
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
  expect_refused("level = -1: must be finite", "--level -1");
  expect_refused("not valid JSON", "--options {x");
}

TEST(Program, ExportedTablesRefuseTheChoiceOfOneCase) {
  const TempFolder temp;
  const std::string out = (temp.path() / "table").string();
  for (const std::string flag :
       {"--source synthetic:city", "--estimator joint_flow", "--level 0.1", "--seed 3", "--no-images"}) {
    for (const std::string format : {"csv", "npz", "sqlite"})
      expect_bad_input(
          sextant_program(
              fmt::format("export {} --format {} --out {} {}", temp.path().string(), format, out, flag)),
          flag.substr(0, flag.find(' ')) + ": is for --format mcap, which holds one case: " + format);
  }
}

TEST(Program, RefusesBadUsageInOneLine) {
  const TempFolder temp;
  const std::string out = (temp.path() / "results").string();
  expect_bad_input(sextant_program("run vdo:" + (temp.path() / "none").string() + " --out " + out), "none");
  EXPECT_FALSE(fs::exists(out));
  expect_bad_input(sextant_program("data"), "a command is missing");
  expect_bad_input(sextant_program("rnu"), "did you mean 'run'");
  expect_bad_input(sextant_program("data chek"), "did you mean 'check'");
  expect_bad_input(sextant_program("run --outt x y"), "did you mean '--out'");
  expect_bad_input(sextant_program("run nowhere --out " + out), "nowhere");
}

/// The words of every command, from the man pages: "evaluate ego".
std::vector<std::string> all_command_words() {
  const TempFolder temp;
  const std::string folder = (temp.path() / "man").string();
  EXPECT_EQ(sextant_program("man --out " + folder).code, 0);
  std::vector<std::string> commands;
  for (const auto& page : fs::directory_iterator(folder)) {
    std::string words = page.path().stem().string();
    std::ranges::replace(words, '-', ' ');
    commands.push_back(words.substr(std::string("sextant").size()));
  }
  return commands;
}

/// The commands that a help text shows as examples: indented lines below "Example:" or "Examples:".
std::vector<std::string> examples_in(const std::string& help) {
  std::vector<std::string> examples;
  bool is_below = false;
  for (const std::string& line : split(help, '\n')) {
    if (line.starts_with("Example"))
      is_below = true;
    else if (!line.starts_with("  "))
      is_below = false;
    else if (is_below)
      examples.emplace_back(trimmed(line));
  }
  return examples;
}

TEST(Program, EveryHelpHasExamplesOfItsOwn) {
  const std::vector<std::string> commands = all_command_words();
  EXPECT_GE(commands.size(), 30U);
  EXPECT_THAT(commands,
              testing::IsSupersetOf({"", " baseline", " baseline update", " sweep status", " evaluate ego"}));
  for (const std::string& command : commands) {
    const Outcome outcome = sextant_program(command + " --help");
    EXPECT_EQ(outcome.code, 0) << command;
    const std::vector<std::string> examples = examples_in(outcome.out);
    EXPECT_FALSE(examples.empty()) << "sextant" << command;
    for (const std::string& example : examples)
      EXPECT_THAT(example,
                  HasSubstr("sextant" + command + (example.ends_with("sextant" + command) ? "" : " ")));
  }
}

TEST(Program, ListsVersionAdaptersAndOptions) {
  EXPECT_THAT(sextant_program("--version").out, HasSubstr("sextant 0."));
  EXPECT_THAT(sextant_program("data list").out, HasSubstr("vdo"));
  EXPECT_THAT(sextant_program("options").out, HasSubstr("estimator.sigma_flow_px"));
}

TEST(Program, AFullStandardOutputIsAnError) {
  for (const char* arguments :
       {"options --json", "options", "data list", "--help", "compare --show-policy"}) {
    const TempFolder temp;
    const std::string err = (temp.path() / "err").string();
    const int status =
        std::system(fmt::format("{} {} > /dev/full 2> {}", SEXTANT_PROGRAM, arguments, err).c_str());
    expect_bad_input({WEXITSTATUS(status), "", read_file(err)},
                     "standard output: cannot write all of it: No space");
  }
}

TEST(Program, AFileBeyondTheLimitOfTheShellIsAnError) {
  const TempFolder temp;
  const std::string err = (temp.path() / "err").string(), out = (temp.path() / "out").string();
  for (const char* arguments : {"run synthetic:s18@0-1", "data make synthetic:s18@0-1 --layout vdo"}) {
    const int status = std::system(
        fmt::format("ulimit -f 8; {} {} --out {} --quiet 2> {}", SEXTANT_PROGRAM, arguments, out, err)
            .c_str());
    expect_bad_input({WEXITSTATUS(status), "", read_file(err)}, "File too large");
    EXPECT_FALSE(fs::exists(out + "/records.jsonl") || fs::exists(out + "/camera.yaml"));
  }
}

TEST_F(ProgramOnFixture, NamesThatAreNotUtf8AreRefusedAtTheStart) {
  const std::string name = (temp_.path() / "\xff").string();
  const std::string plan = (temp_.path() / "plan.json").string();
  write_file(plan, "{\"sources\":[\"" + fixture_.source() + "\"],\"estimators\":[\"joint_flow\"]}");
  for (const std::string& command : std::vector<std::string>{
           "run " + fixture_.source() + " --out '" + name + "'",
           "run vdo:" + name + " --out " + out().string(), "sweep " + plan + " --out '" + name + "'",
           "data pack " + fixture_.source() + " --cache '" + name + "'", "report '" + name + "'",
           "compare '" + name + "' '" + name + "'", "trend '" + name + "'", "evaluate ego '" + name + "' b",
           "evaluate flow a '" + name + "'", "data make s18 --layout kitti --out '" + name + "'"}) {
    expect_bad_input(sextant_program(command), "is not UTF-8");
  }
  EXPECT_FALSE(fs::exists(name));
  EXPECT_FALSE(fs::exists(out()));
}

// A folder in between cannot be refused: its names are found when it is read.
TEST_F(ProgramOnFixture, NamesThatAreNotUtf8WithinAFolderAreWrittenEscaped) {
  const fs::path runs = temp_.path() / "runs";
  ASSERT_EQ(run().code, 0);
  fs::create_directories(runs);
  fs::copy(out(), runs / "a\xff", fs::copy_options::recursive);
  fs::copy(out(), runs / "b", fs::copy_options::recursive);
  const Outcome trend = sextant_program("trend --json " + runs.string());
  EXPECT_EQ(trend.code, 0) << trend.err;
  EXPECT_THAT(trend.out, HasSubstr("a\uFFFD"));
  const std::string page = (temp_.path() / "trend.html").string();
  EXPECT_EQ(sextant_program("trend " + runs.string() + " --out " + page).code, 0);
  EXPECT_TRUE(is_utf8(read_file(page)));
}

TEST_F(ProgramOnFixture, AFlagWithoutAValueTakesNoOtherArgument) {
  expect_bad_input(sextant_program("run synthetic:s18@0-1 --out= --estimator=motion_only"),
                   "--out: expected a value after '=', got none");
}

TEST_F(ProgramOnFixture, AnEmptyNameIsNoFolder) {
  const std::string plan = (temp_.path() / "plan.json").string();
  write_file(plan, "{\"sources\":[\"" + fixture_.source() + "\"],\"estimators\":[\"joint_flow\"]}");
  ASSERT_EQ(run().code, 0);
  for (const std::string& command : std::vector<std::string>{
           "run " + fixture_.source() + " --out ''", "sweep " + plan + " --out ''",
           "merge " + out().string() + " --out ''", "report " + out().string() + " --out ''",
           "trend " + out().string() + " --out ''", "data make s18 --layout kitti --out ''",
           "overlay " + fixture_.source() + " --out ''", "compare a b --out ''", "evaluate ego a b --out ''",
           "evaluate objects a b --out ''", "reproduce --out ''", "sweep " + plan + " --out x --cache ''"}) {
    expect_bad_input(sextant_program(command), "expected a file or folder, got ''");
  }
}

TEST_F(ProgramOnFixture, JsonOfStrangersIsRefusedByFileAndKey) {
  const std::string bad = (temp_.path() / "bad.json").string();
  const std::string deep(100000, '[');
  const std::string estimator = "--estimator external:" + bad;
  for (const auto& [text, named] :
       std::vector<std::pair<std::string, std::string>>{{"{\n\"a\": 1e400}", "bad.json:2: the number 1e400"},
                                                        {deep, "bad.json:1: more than 100 levels"},
                                                        {"{\"command\":", "bad.json:1: not valid JSON"},
                                                        {"[1]", "expected"},
                                                        {"3", "expected"}}) {
    write_file(bad, text);
    expect_refused(named, estimator);
    expect_refused(named, "--options @" + bad);
    expect_bad_input(sextant_program("sweep " + bad + " --out " + out().string()), named);
    expect_bad_input(sextant_program("compare --policy " + bad + " a b"), named);
    expect_bad_input(sextant_program(fmt::format("compare {0} {0}", bad)), named);
    expect_bad_input(sextant_program("data make s18 --layout kitti --out x --options @" + bad), named);
  }
  for (const char* noise : {"{\"depth\":{\"delta_d_px\":1e400}}", "[]", "3", "{\"depth\":3}",
                            "{\"correlation\":{}}", "{\"depth\":{\"delta_d_px\":[]}}", "{\"flow\":null}"})
    expect_refused("noise", fmt::format("--noise '{}'", noise));
  for (const char* options : {"{\"pipeline\":1}", "[]", "{\"source\":\"a\"}", "{\"estimator\":[]}"})
    expect_refused("expected a", fmt::format("--options '{}'", options));
}

TEST_F(ProgramOnFixture, DamagedRunJsonIsRefusedByFileAndKey) {
  ASSERT_EQ(run().code, 0);
  const fs::path run_json = out() / "run.json";
  const Json good = Json::parse(read_file(run_json));
  const auto with = [&](const char* key, const Json& value) {
    Json json = good;
    json[key] = value;
    write_file(run_json, json.dump());
  };
  const auto expect_named = [&](const std::string& named) {
    for (const std::string& command :
         std::vector<std::string>{"report " + out().string(), fmt::format("compare {0} {0}", out().string()),
                                  "trend " + out().string()})
      expect_bad_input(sextant_program(command), named);
  };
  for (const char* key :
       {"configuration", "sources", "machine", "packages", "git_commit", "cases", "noise"}) {
    with(key, key == std::string("git_commit") ? Json(3) : Json("text"));
    expect_named(fmt::format("run.json: key '{}'", key));
  }
  with("sources", Json::array({Json{{"source", 3}}}));
  expect_named("run.json: sources: key 'source'");
  with("sources", Json::array({Json{{"inputs", {{"a", {{"sha256", 3}}}}}}}));
  expect_named("key 'sha256'");
  write_file(run_json, "{\"a\": 1e400}");
  expect_named("run.json:1: the number 1e400");
}

TEST(Program, LargeFilesAreRefusedBeforeTheyAreRead) {
  const TempFolder temp;
  const auto hole = [&](const std::string& name) {
    const fs::path path = temp.path() / name;
    fs::create_directories(path.parent_path());
    write_file(path, "x");
    fs::resize_file(path, 20'000'000'000);
    return path.string();
  };
  hole("run/records.jsonl");
  const std::string huge = hole("huge.json"), run = (temp.path() / "run").string(),
                    out = (temp.path() / "out").string();
  // Records are read line by line, however long the file is.
  for (const std::string& command :
       std::vector<std::string>{"report " + run, fmt::format("compare {0} {0}", run), "trend " + run})
    expect_bad_input(sextant_program(command), "records.jsonl:1: the line has more than 1048576 bytes");
  for (const std::string& command :
       std::vector<std::string>{"sweep " + huge + " --out " + out, fmt::format("compare {0} {0}", huge),
                                fmt::format("evaluate ego {0} {0}", huge),
                                "run synthetic:s18@0-1 --estimator external:" + huge + " --out " + out,
                                "run synthetic:s18@0-1 --options @" + huge + " --out " + out}) {
    expect_bad_input(sextant_program(command), "has 20.0 GB, expected at most");
  }
}

TEST(Help, ProgramAlonePrintsTheListOfCommands) {
  const Outcome alone = sextant_program(""), help = sextant_program("help");
  EXPECT_EQ(alone.code, 0) << alone.err;
  EXPECT_THAT(alone.out, HasSubstr("evaluate"));
  EXPECT_EQ(alone.err, "");
  EXPECT_EQ(help.code, 0) << help.err;
  EXPECT_EQ(help.out, alone.out);
}

TEST(Help, HelpOfACommandIsTheTextOfItsHelpFlag) {
  for (const char* command : {"run", "evaluate", "evaluate ego", "noise fit"}) {
    const Outcome help = sextant_program(fmt::format("help {}", command));
    EXPECT_EQ(help.code, 0) << help.err;
    EXPECT_EQ(help.out, sextant_program(fmt::format("{} --help", command)).out) << command;
  }
  expect_bad_input(sextant_program("help evaluate eg"),
                   "unknown command 'sextant evaluate eg': did you mean 'ego'?");
  expect_bad_input(sextant_program("help run synthetic:s18"), "'sextant run' has no commands below it");
}

TEST(Overlay, WithoutFlagsDrawsTheFirstPairAndOverwritesNothing) {
  const TempFolder temp;
  const std::string command = fmt::format("overlay synthetic:s18@0-3 --quiet");
  const auto in_folder = [&](const std::string& more) {
    const fs::path err = temp.path() / "err";
    const int status = std::system(fmt::format("cd {} && {} {} {} 2> {}", temp.path().string(),
                                               SEXTANT_PROGRAM, command, more, err.string())
                                       .c_str());
    return Outcome{WEXITSTATUS(status), "", read_file(err)};
  };
  ASSERT_EQ(in_folder("").code, 0);
  expect_bad_input(in_folder(""), "overlay.png: exists already: give another name with --out");
  EXPECT_EQ(in_folder("--frame 1 --out first.png").code, 0);
  EXPECT_EQ(read_file(temp.path() / "overlay.png"), read_file(temp.path() / "first.png"));
}

TEST(Run, WithoutOutputFolderWritesANewOne) {
  const TempFolder temp;
  for (const char* folder : {"run-1", "run-2"}) {
    const std::string command =
        fmt::format("cd {} && {} run synthetic:s18@0-1 --quiet > out", temp.path().string(), SEXTANT_PROGRAM);
    ASSERT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read_file(temp.path() / "out"), fmt::format("Results: {}\n", folder));
    EXPECT_TRUE(fs::exists(temp.path() / folder / "records.jsonl"));
  }
}

}  // namespace
}  // namespace sextant
