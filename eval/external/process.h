#pragma once

// Runs a program with a time limit. It gets a process group of its own: at the time limit, on Ctrl-C and
// after its end the whole group is killed, so nothing that it started stays behind (unless it makes itself a
// group of its own).

#include <filesystem>
#include <string>
#include <vector>

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
  End end = End::exited;
  int code = 0;  ///< exit code, or signal
  double wall_s = 0;

  bool ok() const { return end == End::exited && code == 0; }
  /// "exit code 3", "signal 11 (Segmentation fault)", "killed after the time limit of 5 s", ...
  std::string text() const;
};

/// What stdout and stderr may hold together.
inline constexpr uint64_t most_log_bytes = 100'000'000;

/// stdin is empty. Throws Error when the program cannot be started, Interrupted on Ctrl-C (the group is
/// killed before).
ProcessOutcome run_process(const ProcessRequest& request);

}  // namespace sextant
