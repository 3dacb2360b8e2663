// Ctrl-C while a program of somebody else runs: it ends, and the sweep can be resumed.

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
  EXPECT_FALSE(fs::exists(out / "external" / "case_000001" / "input"));

  write_file(temp.path() / "go", "");
  EXPECT_EQ(exit_code(start_program(command)), 0);
  const std::vector<Record> records = read_records(out / "records.jsonl");
  EXPECT_EQ(
      std::ranges::count_if(records, [](const Record& r) { return r.is_ego() && r.status == Status::ok; }),
      6);  // 3 seeds x 2 pairs
}

/// Exit code of a shell line, and what it printed.
std::pair<int, std::string> shell(const TempFolder& temp, const std::string& line) {
  const fs::path out = temp.path() / "said";
  const int status = std::system(fmt::format("({}) > {} 2>&1", line, out.string()).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(out)};
}

TEST(ExternalProgram, ItsOutputIsScoredAgain) {
  const TempFolder temp;
  const VdoFixture fixture = make_vdo_fixture(temp.path() / "data", {.n_frames = 3});
  write_file(temp.path() / "program.sh",
             "for k in 0 1 2; do echo $k 1 0 0 0 0 1 0 0 0 0 1 $k; done > $1/camera.txt\n"
             "for k in 0 1 2; do echo $k 1 0 0 0 0 1 0 0 0 0 1 0; done > $1/still.txt\n");
  write_file(temp.path() / "program.json", R"({"command": "sh {config}/program.sh {output}"})");
  const std::string here = temp.path().string();
  const auto [code, said] =
      shell(temp, fmt::format("{} run {} --estimator external:{}/program.json --out {}/out", SEXTANT_PROGRAM,
                              fixture.source(), here, here));
  ASSERT_EQ(code, 0) << said;
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
    // The limit is none for root.
    const std::string user = ::geteuid() == 0 ? "setpriv --reuid=65534 --clear-groups " : "";
    // The leak check of the sanitizers starts a process too.
    return shell(temp, fmt::format("cd {} && export ASAN_OPTIONS=$ASAN_OPTIONS:detect_leaks=0 && {}prlimit --nproc=1 -- {} {}",
                                   here, user, SEXTANT_PROGRAM, arguments));
  };
  const std::string outside = fmt::format("run {} --estimator external:program.json", fixture.source());
  // The second starts threads itself, the third has a library that does.
  for (const std::string& what :
       {outside + " --jobs 1", outside + " --jobs 2", std::string("run synthetic:s18@0-1")}) {
    const auto [code, said] = limited(fmt::format("{} --out {}/out", what, here));
    EXPECT_EQ(code, 2) << said;
    EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
    EXPECT_THAT(said, HasSubstr("ulimit -u"));
  }
}

}  // namespace
}  // namespace sextant
