#include "sextant/eval/external/process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "sextant/base/error.h"
#include "sextant/eval/experiment/interrupt.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds shortest_wait(1), longest_wait(20), grace(1000);

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (std::string& text : texts) out.push_back(text.data());
  out.push_back(nullptr);
  return out;
}

/// This process's environment with `settings` over it.
std::vector<std::string> environment_with(const std::vector<std::string>& settings) {
  const auto name_of = [](const std::string& setting) { return setting.substr(0, setting.find('=')); };
  std::vector<std::string> all;
  for (char** present = environ; *present != nullptr; ++present) {
    const bool replaced = std::ranges::any_of(
        settings, [&](const std::string& setting) { return name_of(setting) == name_of(*present); });
    if (!replaced) all.emplace_back(*present);
  }
  all.insert(all.end(), settings.begin(), settings.end());
  return all;
}

/// A child and its group, which does not outlive this.
class Child {
 public:
  explicit Child(const ProcessRequest& request) {
    std::vector<std::string> words = request.words;
    std::vector<std::string> environment = environment_with(request.environment);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
    constexpr int flags = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&files, 1, request.stdout_file.c_str(), flags, 0644);
    posix_spawn_file_actions_addopen(&files, 2, request.stderr_file.c_str(), flags, 0644);
    posix_spawn_file_actions_addchdir_np(&files, request.working_directory.c_str());
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
    posix_spawnattr_setpgroup(&attributes, 0);
    sigset_t signals;
    sigfillset(&signals);
    posix_spawnattr_setsigdefault(&attributes, &signals);
    sigemptyset(&signals);
    posix_spawnattr_setsigmask(&attributes, &signals);
    const int error = posix_spawnp(&id_, words.at(0).c_str(), &files, &attributes, pointers(words).data(),
                                   pointers(environment).data());
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (error != 0) {
      id_ = -1;
      fail("cannot start '{}' in {}: {}", request.words.at(0), request.working_directory.string(),
           std::strerror(error));
    }
  }
  ~Child() {
    if (id_ < 0) return;
    ::kill(-id_, SIGKILL);
    siginfo_t ignored;
    while (::waitid(P_PID, static_cast<id_t>(id_), &ignored, WEXITED) != 0 && errno == EINTR) {
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Whether it has ended; it stays a zombie, so that its group's number is not given to others.
  bool ended(ProcessOutcome& outcome) const {
    siginfo_t info{};
    if (::waitid(P_PID, static_cast<id_t>(id_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid == 0)
      return false;
    outcome.end = info.si_code == CLD_EXITED ? ProcessOutcome::End::exited : ProcessOutcome::End::signalled;
    outcome.code = info.si_status;
    return true;
  }

  /// Asks the group to end; it has a moment to write what it has.
  void ask_to_end() const {
    ::kill(-id_, SIGTERM);
    ProcessOutcome ignored;
    for (const auto stop = Clock::now() + grace; Clock::now() < stop && !ended(ignored);)
      std::this_thread::sleep_for(longest_wait);
  }

 private:
  pid_t id_ = -1;
};

uint64_t log_bytes(const ProcessRequest& request) {
  uint64_t sum = 0;
  for (const fs::path& file : {request.stdout_file, request.stderr_file}) {
    std::error_code error;
    const uint64_t bytes = fs::file_size(file, error);
    sum += error ? 0 : bytes;
  }
  return sum;
}

}  // namespace

std::string ProcessOutcome::text() const {
  switch (end) {
    case End::exited:
      return fmt::format("exit code {}", code);
    case End::signalled:
      return fmt::format("signal {} ({})", code, ::strsignal(code));
    case End::timed_out:
      return fmt::format("killed at the time limit, after {:.1f} s", wall_s);
    case End::too_much_log:
      return fmt::format("killed: it wrote more than {} MB to stdout and stderr", most_log_bytes / 1'000'000);
  }
  SEXTANT_CHECK(false);
}

ProcessOutcome run_process(const ProcessRequest& request) {
  const Clock::time_point start = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  const Child child(request);
  ProcessOutcome outcome;
  auto wait = shortest_wait;
  while (!child.ended(outcome)) {
    check_interrupt();
    const bool too_late = seconds() > request.time_limit_s;
    if (too_late || log_bytes(request) > most_log_bytes) {
      outcome.wall_s = seconds();
      child.ask_to_end();
      outcome.end = too_late ? ProcessOutcome::End::timed_out : ProcessOutcome::End::too_much_log;
      outcome.code = 0;
      return outcome;
    }
    std::this_thread::sleep_for(wait);
    wait = std::min(2 * wait, longest_wait);
  }
  outcome.wall_s = seconds();
  return outcome;
}

}  // namespace sextant
