#pragma once

// A progress line with rate and remaining time on standard error: "frames 12/19  24.1/s  0.3 s left".
// Shown only on a terminal; silent in a pipe and with `quiet`. Safe to advance from several threads.

#include <chrono>
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
  void draw(Clock::time_point now);

  std::string what_;
  int total_;
  bool shown_;
  std::mutex mutex_;
  int done_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_draw_{};
};

}  // namespace sextant
