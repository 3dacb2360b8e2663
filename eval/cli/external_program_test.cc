// Ctrl-C while an external program runs: the program ends, and the sweep can be resumed.

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "sextant/base/files.h"
#include "sextant/datasets/vdo_folder_testing.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

pid_t start_program(const std::vector<std::string>& arguments) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  std::vector<char*> words = {const_cast<char*>(SEXTANT_PROGRAM)};
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  if (::freopen("/dev/null", "w", stderr) == nullptr) ::_exit(99);
  ::execv(SEXTANT_PROGRAM, words.data());
  ::_exit(99);
}

int exit_code(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

bool runs(int pid) {
  std::ifstream in(fs::path("/proc") / std::to_string(pid) / "stat");
  std::string line;
  return std::getline(in, line) && line.find(") Z ") == std::string::npos;
}

TEST(ExternalProgram, CtrlCEndsItAndTheSweepIsResumed) {
  const TempFolder temp;
  const VdoFixture fixture = make_vdo_fixture(temp.path() / "data", {.n_frames = 3});
  // The second seed hangs until there is a file `go`.
  write_file(
      temp.path() / "program.sh",
      "dir=$(dirname $0)\n"
      "if [ $2 = 1 ] && [ ! -e $dir/go ]; then echo $$ > $dir/part; mv $dir/part $dir/pid; sleep 6000; fi\n"
      "for k in 0 1 2; do echo $k 1 0 0 0 0 1 0 0 0 0 1 $k; done > $1/camera.txt\n");
  write_file(temp.path() / "program.json", R"({"command": "sh {config}/program.sh {output} {seed}"})");
  write_file(
      temp.path() / "plan.json",
      Json{{"sources", {fixture.source()}}, {"estimators", {"external:program.json"}}, {"seeds", 3}}.dump());
  const fs::path out = temp.path() / "out";
  const std::vector<std::string> command = {
      "sweep",   (temp.path() / "plan.json").string(), "--out",  out.string(), "--jobs", "1",
      "--cache", (temp.path() / "cache").string(),     "--quiet"};
  const pid_t first = start_program(command);
  while (!fs::exists(temp.path() / "pid")) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const int program = std::stoi(read_file(temp.path() / "pid"));
  EXPECT_TRUE(runs(program));
  ::kill(first, SIGINT);
  EXPECT_EQ(exit_code(first), 130);
  EXPECT_FALSE(runs(program));
  EXPECT_TRUE(fs::exists(out / "journal.jsonl"));
  EXPECT_FALSE(fs::exists(out / "records.jsonl"));

  write_file(temp.path() / "go", "");
  EXPECT_EQ(exit_code(start_program(command)), 0);
  const std::vector<Record> records = read_records(out / "records.jsonl");
  EXPECT_EQ(
      std::ranges::count_if(records, [](const Record& r) { return r.is_ego() && r.status == Status::ok; }),
      6);  // 3 seeds x 2 pairs
  // On a busy machine the interrupted process may end before it has removed the input; the next one does.
  EXPECT_FALSE(fs::exists(out / "external" / "case_000001" / "input"));
}

/// Runs a shell line; returns its exit code and output.
std::pair<int, std::string> shell(const TempFolder& temp, const std::string& line) {
  const fs::path out = temp.path() / "message";
  const int status = std::system(fmt::format("({}) > {} 2>&1", line, out.string()).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(out)};
}

/// A plan of six seeds, a program and its configuration in a folder, as in the repository of a maintainer.
class ChangedProgram : public testing::Test {
 protected:
  ChangedProgram() {
    fs::create_directories(at("more"));
    fixture_ = make_vdo_fixture(folder_.path() / "data", {.n_frames = 3});
    write(1, 1);
    configure(Json::object());
    write_file(at("gate.json"), Json{{"sources", {fixture_.source()}},
                                     {"estimators", {"external:program.json"}},
                                     {"noise", {{"parameter", "depth.delta_d_px"}, {"levels", {0.1}}}},
                                     {"seeds", 6}}
                                    .dump());
    sweep("base");
  }

  fs::path at(const std::string& name) const { return folder_.path() / "mine" / name; }
  /// Steps of the camera: what the script says, times what a file says, and a little that differs from seed
  /// to seed.
  void write(int in_script, int in_file) const {
    write_file(at("program.sh"),
               fmt::format("f=$(cat more/factor)\nfor k in 0 1 2; do echo $k 1 0 0 0 0 1 0 0 0 0 1 "
                           "$((k * {} * f)).$((k * $2)); done > $1/camera.txt\n",
                           in_script));
    write_file(at("more/factor"), fmt::format("{}\n", in_file));
  }
  void configure(Json more) const {
    more["command"] = "sh program.sh {output} {seed}";
    write_file(at("program.json"), more.dump());
  }
  std::string run(const std::string& arguments, int code) const {
    const auto [found, message] = shell(
        folder_, fmt::format("cd {} && SEXTANT_CACHE= {} {}", at("").string(), SEXTANT_PROGRAM, arguments));
    EXPECT_EQ(found, code) << arguments << "\n" << message;
    return message;
  }
  std::string sweep(const std::string& out, const std::string& more = "") const {
    return run(fmt::format("sweep gate.json --out {} --cache ../cache --quiet {}", out, more), 0);
  }
  std::string compare(int code, const std::string& more = "") const {
    return run("compare base new --only accuracy " + more, code);
  }

  TempFolder folder_;
  VdoFixture fixture_;
};

TEST_F(ChangedProgram, AnUnchangedOneIsNotRunAgain) {
  EXPECT_EQ(sweep("new"), "Results: new\n");
  const std::string bytes = read_file(at("new/records.jsonl")), provenance = read_file(at("new/run.json"));
  EXPECT_EQ(sweep("new"), "Results: new\n");
  EXPECT_EQ(read_file(at("new/records.jsonl")), bytes);  // with their times
  EXPECT_EQ(read_file(at("new/run.json")), provenance);
  EXPECT_THAT(compare(0), HasSubstr("same program"));
}

TEST_F(ChangedProgram, BaselinesWithoutFingerprintsAreCompared) {
  sweep("new");
  Json run = read_json(at("base/run.json"));
  run.erase("fingerprints");
  run["configuration"]["estimators"][0]["options"].erase("depends");
  write_file(at("base/run.json"), json_text(run));
  EXPECT_THAT(compare(0),
              AllOf(HasSubstr("(not recorded)"), HasSubstr("depends"), HasSubstr("program: program.sh")));
}

TEST_F(ChangedProgram, EndsInTheRightVerdict) {
  const std::string note = "sextant: note: new: 'program': another version of it made 6 finished cases";
  sweep("new");
  write(100, 1);
  EXPECT_THAT(sweep("new"), HasSubstr(note + " (program.sh changed): run again"));
  EXPECT_THAT(compare(1), testing::ContainsRegex("program +program: program.sh"));
  write(1, 1);
  sweep("new");
  compare(0);
  write(1, 100);
  EXPECT_THAT(sweep("new"), HasSubstr(note + " (more/factor changed): run again"));
  compare(1);
  EXPECT_THAT(sweep("new", "--force"), Not(HasSubstr("note")));
  compare(1);
  write(1, 1);
  EXPECT_THAT(sweep("new", "--reuse-stale"), HasSubstr("kept, as --reuse-stale says"));
  compare(1);
}

TEST_F(ChangedProgram, IsSeenInAFileThatDependsAloneNames) {
  configure({{"depends", {"program.sh"}}});
  sweep("new", "--force");
  write(1, 100);
  EXPECT_EQ(sweep("new"), "Results: new\n");  // the configuration does not name the file
  configure({{"depends", {"program.sh", "more/*"}}});
  EXPECT_THAT(sweep("new"), HasSubstr("configuration changed"));
  write(1, 1);
  EXPECT_THAT(sweep("new"), HasSubstr("(more/factor changed)"));
  compare(0, "--allow configuration");
}

TEST_F(ChangedProgram, IsSeenInItsConfiguration) {
  sweep("new");
  configure({{"camera", {{"inverse", true}}}});
  EXPECT_THAT(sweep("new"), HasSubstr("(configuration changed): run again"));
  EXPECT_THAT(compare(2), HasSubstr("camera.inverse"));  // other options are another question
  compare(1, "--allow configuration");
}

TEST(ExternalProgram, ItsOutputIsScoredAgain) {
  const TempFolder temp;
  const VdoFixture fixture = make_vdo_fixture(temp.path() / "data", {.n_frames = 3});
  write_file(temp.path() / "program.sh",
             "for k in 0 1 2; do echo $k 1 0 0 0 0 1 0 0 0 0 1 $k; done > $1/camera.txt\n"
             "for k in 0 1 2; do echo $k 1 0 0 0 0 1 0 0 0 0 1 0; done > $1/still.txt\n");
  write_file(temp.path() / "program.json", R"({"command": "sh {config}/program.sh {output}"})");
  const std::string here = temp.path().string();
  const auto [code, message] =
      shell(temp, fmt::format("{} run {} --estimator external:{}/program.json --out {}/out", SEXTANT_PROGRAM,
                              fixture.source(), here, here));
  ASSERT_EQ(code, 0) << message;
  const auto [again, table] =
      shell(temp, fmt::format("{} rescore {}/out --set estimator.camera.file=still.txt --out {}/again",
                              SEXTANT_PROGRAM, here, here));
  ASSERT_EQ(again, 0) << table;
  for (const Record& record : read_records(temp.path() / "again" / "records.jsonl")) {
    if (record.is_ego()) {
      EXPECT_EQ(record.values.at("step_m"), 0);
    }
  }
  const auto [onto, refused] =
      shell(temp, fmt::format("{} rescore {}/out --out {}/out", SEXTANT_PROGRAM, here, here));
  EXPECT_EQ(onto, 2) << refused;
  const auto [none, missing] =
      shell(temp, fmt::format("{} rescore {}/data --out {}/x", SEXTANT_PROGRAM, here, here));
  EXPECT_EQ(none, 2) << missing;
}

TEST(ExternalProgram, NoMoreProcessesAllowed) {
  const TempFolder temp;
  const VdoFixture fixture = make_vdo_fixture(temp.path() / "data", {.n_frames = 3});
  write_file(temp.path() / "program.json", R"({"command": "true"})");
  fs::permissions(temp.path(), fs::perms::all);
  fs::permissions(temp.path() / "data", fs::perms::all);
  const std::string here = temp.path().string();
  const auto limited = [&](const std::string& arguments) {
    // The limit does not apply to root, and another user may not reach the program in a folder of root's.
    const std::string user = ::geteuid() == 0 ? "setpriv --reuid=65534 --clear-groups "
                                                "--inh-caps=+dac_override --ambient-caps=+dac_override "
                                              : "";
    // The leak check of the sanitizers starts a process too.
    return shell(
        temp, fmt::format(
                  "cd {} && export ASAN_OPTIONS=$ASAN_OPTIONS:detect_leaks=0 && {}prlimit --nproc=1 -- {} {}",
                  here, user, SEXTANT_PROGRAM, arguments));
  };
  const std::string outside = fmt::format("run {} --estimator external:program.json", fixture.source());
  // The second starts threads itself, the third has a library that does.
  for (const std::string& what :
       {outside + " --jobs 1", outside + " --jobs 2", std::string("run synthetic:s18@0-1")}) {
    const auto [code, message] = limited(fmt::format("{} --out {}/out", what, here));
    if (message.find("embree::MutexSys") != std::string::npos)
      GTEST_SKIP() << "Embree 3.12 aborts where it may not start a thread";
    EXPECT_EQ(code, 2) << message;
    EXPECT_EQ(std::ranges::count(message, '\n'), 1) << message;
    EXPECT_THAT(message, HasSubstr("ulimit -u"));
  }
}

}  // namespace
}  // namespace sextant
