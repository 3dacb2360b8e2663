#include "sextant/base/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <utility>
#include <vector>

namespace sextant {
namespace {

constexpr double first_log_s = 5;
constexpr double longest_pause_s = 60;
constexpr double worth_reporting_s = 0.5;
constexpr size_t most_listed = 8;

/// Durations of the stages by name, in order of first appearance.
struct Taken {
  std::mutex mutex;
  std::vector<std::pair<std::string, double>> parts;
};

Taken& taken() {
  static Taken all;
  return all;
}

}  // namespace

Progress::Progress(std::string what, int total, bool quiet)
    : what_(std::move(what)),
      total_(total),
      quiet_(quiet),
      terminal_(::isatty(STDERR_FILENO) == 1),
      next_log_s_(first_log_s) {}

Progress::~Progress() {
  if (quiet_) return;
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
  {
    Taken& all = taken();
    const std::scoped_lock lock(all.mutex);
    auto part = std::ranges::find(all.parts, what_, &std::pair<std::string, double>::first);
    if (part == all.parts.end()) part = all.parts.insert(all.parts.end(), {what_, 0.0});
    part->second += elapsed_s;
  }
  if (terminal_ && done_ > 0) print_error("\r\033[K");
  if (logged_) print_error(fmt::format("{} {}/{} in {:.1f} s\n", what_, done_, total_, elapsed_s));
}

void Progress::advance(int steps) {
  const std::scoped_lock lock(mutex_);
  done_ += steps;
  if (quiet_) return;
  const Clock::time_point now = Clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  if (terminal_) {
    if (done_ < total_ && now - last_draw_ < std::chrono::milliseconds(100)) return;
    last_draw_ = now;
    print_error(fmt::format("\r\033[K{}", line(elapsed_s)));
    std::fflush(stderr);
  } else if (elapsed_s >= next_log_s_ && done_ < total_) {
    next_log_s_ = elapsed_s + std::min(elapsed_s, longest_pause_s);
    logged_ = true;
    print_error(fmt::format("{}\n", line(elapsed_s)));
  }
}

std::string Progress::line(double elapsed_s) const {
  const double rate = done_ / (elapsed_s > 0 ? elapsed_s : 1);
  return fmt::format("{} {}/{}  {:.1f}/s  {:.1f} s left", what_, done_, total_, rate,
                     rate > 0 ? (total_ - done_) / rate : 0.0);
}

std::string time_summary() {
  Taken& all = taken();
  const std::scoped_lock lock(all.mutex);
  std::vector<std::pair<std::string, double>> parts = all.parts;
  std::ranges::stable_sort(parts, std::greater(), &std::pair<std::string, double>::second);
  std::erase_if(parts, [](const auto& part) { return part.second < worth_reporting_s; });
  std::string text;
  for (size_t i = 0; i < std::min(parts.size(), most_listed); ++i)
    text += fmt::format("{}{} {:.1f} s", i > 0 ? ", " : "", parts[i].first, parts[i].second);
  if (parts.size() > most_listed) text += fmt::format(", {} more", parts.size() - most_listed);
  return text;
}

}  // namespace sextant
