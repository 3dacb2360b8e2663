#pragma once

// Progress of a long computation on standard error: one line per stage with done / total, rate and remaining
// time.
//
//   a terminal   "frames 12/19  24.1/s  0.3 s left", updated in place and erased at the end
//   otherwise    a plain log: the same text on lines of its own after 5, 10, 20, 40, .. s, at least every
//                minute, and "frames 19/19 in 31.2 s" at the end; nothing for stages that take less than 5 s
//
// Silent with `quiet`. advance() is safe to call from several threads. time_summary() reports the duration of
// each stage.

#include <fcntl.h>
#include <unistd.h>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <string>

namespace sextant {

class Progress {
 public:
  Progress(std::string what, int total, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(int steps = 1);

 private:
  using Clock = std::chrono::steady_clock;
  std::string line(double elapsed_s) const;

  std::string what_;
  int total_;
  bool quiet_, terminal_;
  std::mutex mutex_;
  int done_ = 0;
  double next_log_s_;
  bool logged_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_draw_{};
};

/// Returns the durations of the stages that have ended, longest first: "cases 61.0 s, figures 8.2 s".
/// Durations of stages with the same name are added. Stages with `quiet` and sums below 0.5 s are left out;
/// of more than eight stages only the first eight are named, followed by ", 3 more". Empty if no stage is
/// left.
std::string time_summary();

// Standard streams of a program that may have been started with some of them closed.

/// Opens /dev/null for each closed standard stream. Otherwise the next file to be opened would get the number
/// of that stream, and printed text would be written into it. Call this before any file is opened.
inline void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1) continue;
    // open() returns the lowest free descriptor, which is this one.
    if (::open("/dev/null", stream == STDIN_FILENO ? O_RDONLY : O_WRONLY) != stream) std::abort();
  }
}

/// Writes to standard error. If that fails (closed, or a full disk), the text is lost and the program
/// continues, since messages are not results.
inline void print_error(const std::string& text) {
  if (std::fputs(text.c_str(), stderr) < 0) std::clearerr(stderr);
}

}  // namespace sextant
