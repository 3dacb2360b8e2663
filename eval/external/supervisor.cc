#include "sextant/eval/external/supervisor.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <ctime>
#include <string_view>

namespace sextant {
namespace {

constexpr int shortest_look_ms = 1, longest_look_ms = 20;
constexpr double grace_s = 1, killing_s = 5;
constexpr double margin_s = 2;  // for a busy machine
constexpr double kb = 1024, mb = 1e6;

double now_s() {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Returns the beginning of a file of /proc, in `buffer`.
std::string_view peek(const char* path, char* buffer, size_t size) {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return {};
  const ssize_t n = ::read(file, buffer, size);
  ::close(file);
  return {buffer, n > 0 ? static_cast<size_t>(n) : 0};
}

/// The path "/proc/PID/WHAT", built without allocation.
class ProcPath {
 public:
  explicit ProcPath(pid_t pid) { add("/proc/").add(pid); }
  ProcPath& add(const char* part) {
    while (*part != '\0') *end_++ = *part++;
    return *this;
  }
  ProcPath& add(pid_t pid) {
    end_ = std::to_chars(end_, text_ + sizeof text_ - 1, pid).ptr;
    return *this;
  }
  const char* text() const { return text_; }

 private:
  char text_[64] = {};
  char* end_ = text_;
};

/// Calls use(pid) for each child of the process's first thread.
template <typename Use>
void for_each_child(pid_t parent, const Use& use) {
  char buffer[1 << 14];
  ProcPath path(parent);
  std::string_view text = peek(path.add("/task/").add(parent).add("/children").text(), buffer, sizeof buffer);
  while (!text.empty()) {
    pid_t pid = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), pid);
    // A number that the buffer truncates is not followed by a blank: the next call reads it.
    if (error != std::errc() || end == text.data() + text.size()) return;
    use(pid);
    text.remove_prefix(static_cast<size_t>(end - text.data()) + 1);
  }
}

/// Returns the peak resident size of the process in bytes; 0 if it is gone.
double peak_bytes(pid_t pid) {
  char buffer[4096];
  const std::string_view status = peek(ProcPath(pid).add("/status").text(), buffer, sizeof buffer);
  const size_t at = status.find("VmHWM:");
  if (at == std::string_view::npos) return 0;
  const size_t digits = status.find_first_of("0123456789", at);
  int64_t kilobytes = 0;
  if (digits != std::string_view::npos)
    std::from_chars(status.data() + digits, status.data() + status.size(), kilobytes);
  return kb * static_cast<double>(kilobytes);
}

/// Kills the children of this process and, as they become its children, all descendants. Returns false if
/// some survive.
bool kill_children(double stop_s) {
  while (now_s() < stop_s) {
    for_each_child(::getpid(), [](pid_t pid) { ::kill(pid, SIGKILL); });
    pid_t pid = 0;
    while ((pid = ::waitpid(-1, nullptr, WNOHANG)) > 0) {
    }
    if (pid < 0 && errno == ECHILD) return true;
    ::poll(nullptr, 0, shortest_look_ms);
  }
  return false;
}

class Supervisor {
 public:
  /// `guard` is the process id of the guard, the parent of this process.
  Supervisor(const Supervised& program, pid_t guard) : program_(program), guard_(guard) {}

  SupervisorReport run() {
    report_.start_error = ::posix_spawnp(&pid_, program_.program, program_.files, program_.attributes,
                                         program_.arguments, program_.environment);
    for (const int stream : program_.streams) ::close(stream);
    if (report_.start_error != 0) return report_;
    watch();
    // A new process starts with the size of its parent: ru_maxrss below that carries no information.
    const double inherited_bytes = 1.02 * peak_bytes(::getpid()) + mb;
    kill_all();
    copy_output();
    if (log_bytes_ > program_.most_log_bytes && report_.outcome.end != ProcessOutcome::End::timed_out) {
      report_.outcome.end = ProcessOutcome::End::too_much_log;
      report_.outcome.code = 0;
    }
    rusage used{};
    ::getrusage(RUSAGE_CHILDREN, &used);
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    report_.outcome.cpu_s = seconds(used.ru_utime) + seconds(used.ru_stime);
    const double counted_bytes = kb * static_cast<double>(used.ru_maxrss);
    report_.outcome.peak_memory_mb = (counted_bytes > inherited_bytes ? counted_bytes : peak_bytes_) / mb;
    return report_;
  }

 private:
  /// Waits until the program has ended, or must end.
  void watch() {
    using End = ProcessOutcome::End;
    ProcessOutcome& outcome = report_.outcome;
    const double start = now_s();
    int look_ms = shortest_look_ms;
    bool asked = false;
    double last = start + program_.time_limit_s, next_measure = start;
    while (!ended()) {
      const double now = now_s();
      if (asked && now > last) return;
      if (!asked && (now > last || log_bytes_ > program_.most_log_bytes)) {
        outcome.end = now > last ? End::timed_out : End::too_much_log;
        outcome.wall_s = now - start;
        ::kill(-pid_, SIGTERM);  // gives it a moment to write its results
        last = now + grace_s;
        asked = true;
      }
      if (now >= next_measure) {
        measure(::getpid(), 0);
        next_measure = now + 1e-3 * look_ms;
      }
      pollfd wake[3] = {
          {program_.alive, 0, 0}, {program_.sources[0], POLLIN, 0}, {program_.sources[1], POLLIN, 0}};
      for (int i = 0; i < 2; ++i) {
        if (closed_[i]) wake[1 + i].fd = -1;
      }
      ::poll(wake, 3, look_ms);
      if (wake[0].revents != 0) return;   // the caller does not wait any more
      if (::getppid() != guard_) return;  // the guard was killed
      copy_output();
      look_ms = std::min(2 * look_ms, longest_look_ms);
    }
    if (asked) return;
    outcome.wall_s = now_s() - start;
    outcome.end = end_.si_code == CLD_EXITED ? End::exited : End::signalled;
    outcome.code = end_.si_status;
  }

  /// Returns true if the program has ended; it stays a zombie, so that the number of its group is not reused.
  /// Orphans that have ended are collected on the way.
  bool ended() {
    for (;;) {
      end_ = {};
      if (::waitid(P_ALL, 0, &end_, WEXITED | WNOHANG | WNOWAIT) != 0 || end_.si_pid == 0) return false;
      if (end_.si_pid == pid_) return true;
      ::waitpid(end_.si_pid, nullptr, 0);
    }
  }

  /// Kills the program's group, and repeatedly the processes that become orphans by that.
  void kill_all() {
    const double stop = now_s() + killing_s;
    ::kill(-pid_, SIGKILL);
    report_.outcome.survivors = !kill_children(stop);
  }

  /// Updates the largest size of all processes below `parent`.
  void measure(pid_t parent, int depth) {
    constexpr int deepest = 8;
    if (depth == deepest) return;
    for_each_child(parent, [&](pid_t pid) {
      peak_bytes_ = std::max(peak_bytes_, peak_bytes(pid));
      measure(pid, depth + 1);
    });
  }

  /// Copies the program's new output; some MB at most, so that the time limit is observed.
  void copy_output() {
    constexpr int most_reads = 64;
    char buffer[1 << 16];
    for (int i = 0; i < 2; ++i) {
      for (int reads = 0; reads < most_reads && !closed_[i]; ++reads) {
        const ssize_t n = ::read(program_.sources[i], buffer, sizeof buffer);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) break;
        closed_[i] = n == 0;
        const uint64_t room = program_.most_log_bytes - std::min(log_bytes_, program_.most_log_bytes);
        log_bytes_ += static_cast<uint64_t>(n);
        write(program_.logs[i], buffer, std::min(static_cast<size_t>(n), static_cast<size_t>(room)));
      }
    }
  }

  /// Output that cannot be written is lost: a full disk does not stop the program.
  static void write(int file, const char* bytes, size_t n) {
    while (n > 0) {
      const ssize_t done = ::write(file, bytes, n);
      if (done < 0 && errno == EINTR) continue;
      if (done <= 0) return;
      bytes += done;
      n -= static_cast<size_t>(done);
    }
  }

  const Supervised& program_;
  const pid_t guard_;
  pid_t pid_ = -1;
  siginfo_t end_{};
  bool closed_[2] = {false, false};
  uint64_t log_bytes_ = 0;  ///< written by the program so far
  double peak_bytes_ = 0;
  SupervisorReport report_;
};

/// Waits until the supervisor has ended, was stopped, or is late.
void guard_supervisor(pid_t supervisor, double last_s) {
  while (now_s() < last_s) {
    siginfo_t seen{};
    const int failed =
        ::waitid(P_PID, static_cast<id_t>(supervisor), &seen, WEXITED | WSTOPPED | WNOHANG | WNOWAIT);
    if (failed != 0 || seen.si_pid == supervisor) return;
    ::poll(nullptr, 0, longest_look_ms);
  }
}

/// Closes all files that were open in the copied process, such as the pipes of other programs.
void close_others(const Supervised& program) {
  int mine[] = {2,
                program.alive,
                program.report,
                program.sources[0],
                program.sources[1],
                program.streams[0],
                program.streams[1],
                program.logs[0],
                program.logs[1]};
  std::sort(std::begin(mine), std::end(mine));
  int next = 0;
  for (const int file : mine) {
    if (file > next) ::close_range(static_cast<unsigned>(next), static_cast<unsigned>(file) - 1, 0);
    next = file + 1;
  }
  ::close_range(static_cast<unsigned>(next), ~0U, 0);
}

}  // namespace

pid_t fork_alone() {
#ifdef __SANITIZE_THREAD__
  return ::fork();  // the sanitizer requires this call
#else
  return ::_Fork();
#endif
}

double supervision_limit_s(double time_limit_s) { return time_limit_s + grace_s + killing_s + margin_s; }

void kill_below(pid_t guard) {
  const double stop = now_s() + killing_s;
  for (bool any = true; any && now_s() < stop;) {
    any = false;
    const auto kill_tree = [&](const auto& self, pid_t parent, int depth) -> void {
      constexpr int deepest = 64;
      for_each_child(parent, [&](pid_t pid) {
        if (depth < deepest) self(self, pid, depth + 1);
        any = true;
        ::kill(pid, SIGKILL);
      });
    };
    kill_tree(kill_tree, guard, 0);
    ::kill(guard, SIGCONT);  // so that it collects ended processes
    if (any) ::poll(nullptr, 0, longest_look_ms);
  }
  ::kill(guard, SIGKILL);
}

void supervise(const Supervised& program) {
  close_others(program);
  ::setpgid(0, 0);
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::signal(signal, SIG_IGN);
  const pid_t guard = ::getpid();
  const pid_t supervisor = fork_alone();
  if (supervisor == 0) {
    ::setpgid(0, 0);
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);
    const SupervisorReport report = Supervisor(program, guard).run();
    if (::getppid() != guard) ::_exit(1);  // killed: the program's own exit status is unknown
    const ssize_t written = ::write(program.report, &report, sizeof report);
    ::_exit(written == sizeof report ? 0 : 1);
  }
  SupervisorReport failed;
  failed.start_error = supervisor < 0 ? errno : 0;
  if (supervisor < 0 && ::write(program.report, &failed, sizeof failed) < 0) ::_exit(1);
  ::close(program.report);  // its end marks the end of the supervisor
  for (const int stream : program.streams) ::close(stream);
  if (supervisor > 0) guard_supervisor(supervisor, now_s() + supervision_limit_s(program.time_limit_s));
  ::_exit(kill_children(now_s() + killing_s) ? 0 : 1);
}

}  // namespace sextant
