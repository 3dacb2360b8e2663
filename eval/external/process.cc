#include "sextant/eval/external/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/new_file.h"
#include "sextant/eval/external/supervisor.h"

namespace sextant {
namespace {

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (std::string& text : texts) out.push_back(text.data());
  out.push_back(nullptr);
  return out;
}

/// Returns this process's environment, overridden by `settings`.
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

/// Takes ownership of a descriptor, and moves it away from the numbers of the standard streams, which may
/// have been closed.
Descriptor owned(int fd) {
  if (fd < 0 || fd > 2) return Descriptor(fd);
  const Descriptor low(fd);
  return Descriptor(::fcntl(fd, F_DUPFD_CLOEXEC, 3));
}

[[noreturn]] void fail_to_start(const ProcessRequest& request, int error) {
  const bool is_limit = error == EAGAIN || error == ENOMEM;
  fail("cannot start '{}' in {}: {}{}", request.words.at(0), request.working_directory.string(),
       std::strerror(error),
       is_limit ? " (processes and threads: `ulimit -u`, memory: `ulimit -v`; or give fewer --jobs)" : "");
}

struct Pipe {
  Descriptor read, write;

  explicit Pipe(const ProcessRequest& request) {
    int ends[2] = {-1, -1};
    if (::pipe2(ends, O_CLOEXEC) != 0) fail_to_start(request, errno);
    read = owned(ends[0]);
    write = owned(ends[1]);
  }
};

Descriptor new_file(const fs::path& path) {
  Descriptor file = owned(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (file.get() < 0) fail("{}: cannot create: {}", path.string(), std::strerror(errno));
  return file;
}

/// Settings with which the program is started: files 0, 1, 2 and the folder, a process group of its own, no
/// signal blocked or ignored.
class SpawnSettings {
 public:
  SpawnSettings(const ProcessRequest& request, int out, int err) {
    posix_spawn_file_actions_init(&files_);
    posix_spawn_file_actions_addopen(&files_, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&files_, out, 1);
    posix_spawn_file_actions_adddup2(&files_, err, 2);
    posix_spawn_file_actions_addchdir_np(&files_, request.working_directory.c_str());
    posix_spawnattr_init(&attributes_);
    posix_spawnattr_setflags(&attributes_,
                             POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
    posix_spawnattr_setpgroup(&attributes_, 0);
    sigset_t signals;
    sigfillset(&signals);
    posix_spawnattr_setsigdefault(&attributes_, &signals);
    sigemptyset(&signals);
    posix_spawnattr_setsigmask(&attributes_, &signals);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
  const posix_spawn_file_actions_t* files() const { return &files_; }
  const posix_spawnattr_t* attributes() const { return &attributes_; }

 private:
  posix_spawn_file_actions_t files_{};
  posix_spawnattr_t attributes_{};
};

/// A program, its supervisor and their guard; the destructor ends them.
class Running {
 public:
  explicit Running(const ProcessRequest& request) : alive_(request), report_(request) {
    Pipe out(request), err(request);
    for (const Pipe* pipe : {&out, &err}) ::fcntl(pipe->read.get(), F_SETFL, O_NONBLOCK);
    const Descriptor out_log = new_file(request.stdout_file), err_log = new_file(request.stderr_file);
    std::vector<std::string> words = request.words;
    std::vector<std::string> environment = environment_with(request.environment);
    const std::vector<char*> arguments = pointers(words), variables = pointers(environment);
    const SpawnSettings settings(request, out.write.get(), err.write.get());
    const Supervised program = {.program = arguments.at(0),
                                .arguments = arguments.data(),
                                .environment = variables.data(),
                                .files = settings.files(),
                                .attributes = settings.attributes(),
                                .alive = alive_.read.get(),
                                .report = report_.write.get(),
                                .sources = {out.read.get(), err.read.get()},
                                .streams = {out.write.get(), err.write.get()},
                                .logs = {out_log.get(), err_log.get()},
                                .time_limit_s = request.time_limit_s,
                                .most_log_bytes = most_log_bytes};
    last_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                               supervision_limit_s(request.time_limit_s) + margin_s));
    guard_ = fork_alone();
    if (guard_ == 0) supervise(program);
    if (guard_ < 0) fail_to_start(request, errno);
    alive_.read.close();
    report_.write.close();
  }
  ~Running() {
    if (guard_ < 0) return;
    alive_.write.close();
    last_ = std::min(
        last_, Clock::now() + std::chrono::seconds(static_cast<int>(supervision_limit_s(0) + margin_s)));
    wait_for_guard();
    if (!guard_ended_) kill_below(guard_);
    while (::waitpid(guard_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  SupervisorReport report() const {
    pollfd wake = {report_.read.get(), POLLIN, 0};
    while (::poll(&wake, 1, look_ms) <= 0) {
      check_interrupt();
      if (is_guard_stopped() || Clock::now() > last_) {
        kill_below(guard_);
        break;
      }
    }
    SupervisorReport report;
    // Without a report read() returns 0 at once, since all writers have ended.
    if (::poll(&wake, 1, 0) <= 0 || ::read(report_.read.get(), &report, sizeof report) != sizeof report)
      fail(
          "the process that supervises the program was killed or stopped, so the program's exit status is "
          "unknown");
    return report;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr int look_ms = 50;
  static constexpr double margin_s = 2;

  bool is_guard_stopped() const {
    siginfo_t seen{};
    return ::waitid(P_PID, static_cast<id_t>(guard_), &seen, WSTOPPED | WNOHANG | WNOWAIT) == 0 &&
           seen.si_pid == guard_;
  }

  /// Waits until the guard has ended, unless it was stopped or is late.
  void wait_for_guard() {
    constexpr int short_look_ms = 1;
    while (!guard_ended_ && !is_guard_stopped() && Clock::now() < last_) {
      siginfo_t seen{};
      guard_ended_ = ::waitid(P_PID, static_cast<id_t>(guard_), &seen, WEXITED | WNOHANG | WNOWAIT) == 0 &&
                     seen.si_pid == guard_;
      if (!guard_ended_) ::poll(nullptr, 0, short_look_ms);
    }
  }

  Pipe alive_, report_;
  pid_t guard_ = -1;
  bool guard_ended_ = false;
  Clock::time_point last_;
};

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
  const SupervisorReport report = Running(request).report();
  if (report.start_error != 0) fail_to_start(request, report.start_error);
  return report.outcome;
}

}  // namespace sextant
