#include "sextant/eval/external/process.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/testing.h"

namespace sextant {
namespace {

class Process : public testing::Test {
 protected:
  ProcessRequest request(const std::string& script, double time_limit_s = 3000) const {
    return {.words = {"sh", "-c", script},
            .working_directory = folder_.path(),
            .environment = {},
            .stdout_file = folder_.path() / "stdout.txt",
            .stderr_file = folder_.path() / "stderr.txt",
            .time_limit_s = time_limit_s};
  }
  ProcessOutcome run(const std::string& script, double time_limit_s = 3000) const {
    return run_process(request(script, time_limit_s));
  }
  std::string text(const char* name) const { return read_file(folder_.path() / name); }

  /// Returns true if the process whose id is in the file `name` keeps running. Waits for the file, and long
  /// enough for the end of the process on any machine: the processes of these tests sleep longer.
  bool runs(const char* name) const {
    const fs::path file = folder_.path() / name;
    while (!fs::exists(file) || fs::file_size(file) == 0) pause();
    const fs::path stat = fs::path("/proc") / std::to_string(std::stoi(text(name))) / "stat";
    for (int i = 0; i < 30000; ++i) {
      std::ifstream in(stat);
      std::string line;
      if (!std::getline(in, line) || line.find(") Z ") != std::string::npos) return false;
      pause();
    }
    return true;
  }
  static void pause() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

  TempFolder folder_;
};

TEST_F(Process, OutputAndExitCode) {
  const ProcessOutcome outcome = run("echo hello; echo wrong >&2; exit 3");
  EXPECT_EQ(outcome.text(), "exit code 3");
  EXPECT_FALSE(outcome.survivors);
  EXPECT_EQ(text("stdout.txt"), "hello\n");
  EXPECT_EQ(text("stderr.txt"), "wrong\n");
  EXPECT_EQ(run("kill -SEGV $$").text(), "signal 11 (Segmentation fault)");
}

TEST_F(Process, StandardStreamsMayBeClosed) {
  EXPECT_EQ(status_of_child([&] {
              for (const int stream : {0, 1, 2}) ::close(stream);
              return run("cat; echo hello; echo wrong >&2").ok() ? 0 : 1;
            }),
            0);
  EXPECT_EQ(text("stdout.txt"), "hello\n");
  EXPECT_EQ(text("stderr.txt"), "wrong\n");
}

TEST_F(Process, NothingSurvivesTheEnd) {
  EXPECT_TRUE(run("sleep 6000 & echo $! > child; exit 0").ok());
  EXPECT_FALSE(runs("child"));
  EXPECT_TRUE(run("setsid sh -c 'echo $$ > session; sleep 6000' & while ! [ -s session ]; do :; done").ok());
  EXPECT_FALSE(runs("session"));
  // Its parent ends before the program does.
  EXPECT_TRUE(
      run("(setsid sh -c 'echo $$ > orphan; sleep 6000' &) ; while ! [ -s orphan ]; do :; done").ok());
  EXPECT_FALSE(runs("orphan"));
}

TEST_F(Process, NothingSurvivesTheTimeLimit) {
  ProcessOutcome outcome;
  // On a slow machine the first limits may expire before the session has begun.
  for (double limit_s = 0.4; !fs::exists(folder_.path() / "session") || text("session").empty(); limit_s *= 4)
    outcome = run("trap '' TERM; setsid sh -c 'trap \"\" TERM; echo $$ > session; sleep 6000' & sleep 6000",
                  limit_s);
  EXPECT_EQ(outcome.end, ProcessOutcome::End::timed_out);
  EXPECT_FALSE(outcome.survivors);
  EXPECT_FALSE(runs("session"));
}

TEST_F(Process, NothingSurvivesThisProcess) {
  const pid_t child = ::fork();
  if (child == 0) {
    run("setsid sh -c 'echo $$ > session; sleep 6000' & echo $$ > program; sleep 6000", 6000);
    ::_exit(0);
  }
  while (!fs::exists(folder_.path() / "session") || !fs::exists(folder_.path() / "program")) pause();
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_FALSE(runs("program"));
  EXPECT_FALSE(runs("session"));
}

/// Ids of the processes between a program and this one: supervisor and guard.
constexpr const char* watchers = "s=$PPID; g=$(cut -d ' ' -f 4 /proc/$s/stat); ";
constexpr const char* children =
    "setsid sh -c 'echo $$ > session; sleep 60' & while ! [ -s session ]; do :; done; echo $$ > program; ";

TEST_F(Process, NothingSurvivesAKilledSupervisor) {
  for (const char* attack : {"kill -9 $s; sleep 60", "kill -9 $g; sleep 60"}) {
    for (const char* name : {"session", "program"}) fs::remove(folder_.path() / name);
    expect_error([&] { run(std::string(watchers) + children + attack, 60); }, "was killed or stopped");
    EXPECT_FALSE(runs("program")) << attack;
    EXPECT_FALSE(runs("session")) << attack;
  }
}

TEST_F(Process, AStoppedSupervisorDoesNotHoldUpTheRun) {
  for (const char* attack :
       {"kill -STOP $s; sleep 600", "kill -STOP $g; sleep 600", "kill -STOP $g; kill -STOP $s; sleep 600"}) {
    for (const char* name : {"session", "program"}) fs::remove(folder_.path() / name);
    expect_error([&] { run(std::string(watchers) + children + attack, 600); }, "was killed or stopped");
    EXPECT_FALSE(runs("program")) << attack;
    EXPECT_FALSE(runs("session")) << attack;
  }
}

TEST_F(Process, LogsStopAtTheirLimit) {
  // The program keeps writing while it is asked to end.
  const ProcessOutcome outcome = run("trap '' TERM; yes 'a line of more than a few characters'");
  EXPECT_EQ(outcome.end, ProcessOutcome::End::too_much_log) << outcome.text();
  EXPECT_EQ(fs::file_size(folder_.path() / "stdout.txt"), most_log_bytes);
  // A program that ends before its output is read.
  const ProcessOutcome fast = run("head -c 110000000 /dev/zero");
  EXPECT_EQ(fast.end, ProcessOutcome::End::too_much_log) << fast.text();
  EXPECT_LE(fs::file_size(folder_.path() / "stdout.txt"), most_log_bytes);
}

TEST_F(Process, TimeOfAllProcessesIsCounted) {
  constexpr const char* work = "i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done";
  const ProcessOutcome one = run(work);
  EXPECT_GT(one.cpu_s, 0.02);
  EXPECT_LT(one.cpu_s, one.wall_s + 0.1);
  // An orphan in its own session, which works before the program ends.
  const ProcessOutcome orphan =
      run(fmt::format("(setsid sh -c '{}; echo > done' &) ; while ! [ -e done ]; do sleep 0.05; done", work));
  // a shared core may take twice as long; an uncounted process takes almost no time
  EXPECT_GT(orphan.cpu_s, 0.3 * one.cpu_s);
  EXPECT_LT(run("sleep 0.3").cpu_s, 0.1);
}

TEST_F(Process, PeakMemoryIsThatOfTheLargestProcess) {
  const ProcessOutcome large = run("head -c 400000000 /dev/zero | tail -c 400000000 > /dev/null");
  EXPECT_GT(large.peak_memory_mb, 400);
  EXPECT_LT(large.peak_memory_mb, 500);
  // The size of a small process is its own, not that of this process, which the kernel accounts to it at
  // first.
  const std::vector<char> mine(200'000'000, 'x');
  const ProcessOutcome small = run("sleep 0.2");
  EXPECT_GT(small.peak_memory_mb, 0.1);
  EXPECT_LT(small.peak_memory_mb, 50);
  EXPECT_EQ(mine.back(), 'x');
}

TEST_F(Process, AProgramThatCannotBeStarted) {
  ProcessRequest none = request("");
  none.words = {"./no_such_program"};
  expect_error([&] { run_process(none); }, "cannot start './no_such_program'");
}

TEST_F(Process, NoMoreProcessesAllowed) {
  fs::permissions(folder_.path(), fs::perms::all);
  const int status = status_of_child([&] {
    constexpr uid_t nobody = 65534;
    const rlimit none = {1, 1};
    if (::geteuid() == 0 && ::setuid(nobody) != 0) return 2;  // root has no such limit
    if (::setrlimit(RLIMIT_NPROC, &none) != 0) return 3;
    const std::string message = error_of([&] { run("exit 0"); });
    const bool reported = message.find("cannot start 'sh'") != std::string::npos &&
                          message.find("ulimit -u") != std::string::npos;
    return reported ? 0 : 4;
  });
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace sextant
