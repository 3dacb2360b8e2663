#include "sextant/base/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace sextant {

Progress::Progress(std::string what, int total, bool quiet)
    : what_(std::move(what)), total_(total), shown_(!quiet && ::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (shown_ && done_ > 0) fmt::print(stderr, "\r\033[K");
}

void Progress::advance(int steps) {
  const std::scoped_lock lock(mutex_);
  done_ += steps;
  const Clock::time_point now = Clock::now();
  if (!shown_ || (done_ < total_ && now - last_draw_ < std::chrono::milliseconds(100))) return;
  last_draw_ = now;
  draw(now);
}

void Progress::draw(Clock::time_point now) {
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const double rate = done_ / (elapsed_s > 0 ? elapsed_s : 1);
  fmt::print(stderr, "\r\033[K{} {}/{}  {:.1f}/s  {:.1f} s left", what_, done_, total_, rate,
             rate > 0 ? (total_ - done_) / rate : 0.0);
  std::fflush(stderr);
}

}  // namespace sextant
