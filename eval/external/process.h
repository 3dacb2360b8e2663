#pragma once

// Runs a program with a time limit, and counts what it cost. Beside it runs a supervisor (supervisor.h), a
// fork of this process: whatever the program starts belongs to the supervisor, also in sessions of its own.
// At the time limit, on Ctrl-C, when this process is killed and after the program's end all of it is killed:
// nothing stays behind.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/base/options.h"

namespace sextant {

struct ProcessRequest {
  std::vector<std::string> words;  ///< program, arguments; a program without '/' is looked up in PATH
  std::filesystem::path working_directory;  ///< a relative program is looked up from here
  std::vector<std::string> environment;     ///< NAME=VALUE, on top of this process's
  std::filesystem::path stdout_file;        ///< written anew
  std::filesystem::path stderr_file;
  double time_limit_s = 0;
};

struct ProcessOutcome {
  enum class End { exited, signalled, timed_out, too_much_log };
  friend constexpr Names<4> names_of(End) { return {"exited", "signalled", "timed_out", "too_much_log"}; }
  SEXTANT_OPTIONS(
      (End, end, End::exited, "", "of the program"),
      (int, code, 0, "", "exit code, or signal"),
      (double, wall_s, 0, "s", "time until it ended"),
      (double, cpu_s, 0, "s", "user and system time, of it and of all it started"),
      (double, peak_memory_mb, 0, "MB", "resident size of the largest of these processes"))
  bool survivors = false;  ///< some of them could not be killed (of another user)

  bool ok() const { return end == End::exited && code == 0; }
  /// "exit code 3", "signal 11 (Segmentation fault)", "killed after the time limit of 5 s", ...
  std::string text() const;
};

/// What stdout and stderr may hold together; the rest is thrown away.
inline constexpr uint64_t most_log_bytes = 100'000'000;

/// stdin is empty. Throws Error when the program cannot be started, Interrupted on Ctrl-C (all of it is
/// killed before).
ProcessOutcome run_process(const ProcessRequest& request);

}  // namespace sextant
