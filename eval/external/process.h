#pragma once

// Runs a program with a time limit, and measures its costs. Next to it runs a supervisor (supervisor.h), a
// fork of this process: all processes that the program starts belong to the supervisor, also those in their
// own sessions. At the time limit, on Ctrl-C, when this process is killed and after the program's end, all of
// them are killed: no process is left.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/base/options.h"

namespace sextant {

struct ProcessRequest {
  std::vector<std::string> words;  ///< program and arguments; a program without '/' is searched in PATH
  std::filesystem::path working_directory;  ///< relative paths of the program start here
  std::vector<std::string> environment;     ///< NAME=VALUE, added to this process's environment
  std::filesystem::path stdout_file;        ///< replaced if it exists
  std::filesystem::path stderr_file;
  double time_limit_s = 0;
};

struct ProcessOutcome {
  enum class End { exited, signalled, timed_out, too_much_log };
  friend constexpr Names<4> names_of(End) { return {"exited", "signalled", "timed_out", "too_much_log"}; }
  SEXTANT_OPTIONS((End, end, End::exited, "", "of the program"), (int, code, 0, "", "exit code, or signal"),
                  (double, wall_s, 0, "s", "time until it ended"),
                  (double, cpu_s, 0, "s", "user and system time, of it and of all it started"),
                  (double, peak_memory_mb, 0, "MB", "resident size of the largest of these processes"))
  bool survivors = false;  ///< true if some could not be killed (of another user)

  bool ok() const { return end == End::exited && code == 0; }
  /// Returns "exit code 3", "signal 11 (Segmentation fault)", "killed at the time limit, after 5.0 s", ...
  std::string text() const;
};

/// Limit of stdout and stderr together. A program that writes more is killed, and the rest is discarded.
inline constexpr uint64_t most_log_bytes = 100'000'000;

/// Runs the program with an empty stdin. Throws Error if the program cannot be started, if the files for its
/// output cannot be created, or if the supervisor was killed; Interrupted on Ctrl-C (all processes of the
/// program are killed before).
ProcessOutcome run_process(const ProcessRequest& request);

}  // namespace sextant
