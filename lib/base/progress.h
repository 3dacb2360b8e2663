#pragma once

// What long work says of itself on standard error: one line per part with done / total, rate and remaining
// time.
//
//   a terminal   "frames 12/19  24.1/s  0.3 s left", drawn anew in place, gone at the end
//   else         a plain log: the same as a line of its own after 5, 10, 20, 40, .. s, at least every minute,
//                and "frames 19/19 in 31.2 s" at the end; nothing of work that takes less than 5 s
//
// Silent with `quiet`. Safe to advance from several threads. What each part took is kept for time_summary().

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <mutex>
#include <string>
#include <unistd.h>

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

/// "cases 61.0 s, figures 8.2 s": what took the time since the program began, the longest first; parts of one
/// name together, those that were quiet or short left out. Empty where nothing is left.
std::string time_summary();

// Standard input, output and error of a program that may have been started without them.

/// Opens /dev/null in place of each of the three that is closed: the next file that is opened would get its
/// number, and what is printed would go into it. To be called before anything is opened.
inline void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1) continue;
    // open() takes the lowest free number, which is this one.
    if (::open("/dev/null", stream == STDIN_FILENO ? O_RDONLY : O_WRONLY) != stream) std::abort();
  }
}

/// Writes to standard error. Where that is full or gone the text is lost, and nothing else: it is no result.
inline void print_error(const std::string& text) {
  if (std::fputs(text.c_str(), stderr) < 0) std::clearerr(stderr);
}

}  // namespace sextant
