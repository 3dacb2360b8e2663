#pragma once

// Ctrl-C. Programs install the handler once; long loops call check_interrupt() between steps, which throws
// Interrupted after the signal; the program then cleans up through destructors and exits with code 130.
//
// Code that does not come to check_interrupt() in time, such as a decoder of a library, cannot delay the end:
// a watcher thread ends the program `grace_s` after the signal, as kill -9 would, except that folders which
// RemovedOnInterrupt names are removed before. All outputs are made so that they survive this
// (docs/security.md). A second signal ends the program at once.

#include <filesystem>
#include <stdexcept>
#include <string>

namespace sextant {

class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

/// For SIGINT and SIGTERM. `last_words` is a line for standard error when the watcher ends the program, with
/// `exit_code`.
void install_interrupt_handler(std::string last_words, int exit_code);

bool is_interrupted();

void check_interrupt();

/// Time from the signal until the watcher ends the program.
inline constexpr double interrupt_grace_s = 0.6;

/// Names a temporary folder that the watcher removes, as long as this object lives.
class RemovedOnInterrupt {
 public:
  explicit RemovedOnInterrupt(std::filesystem::path folder);
  ~RemovedOnInterrupt();
  RemovedOnInterrupt(const RemovedOnInterrupt&) = delete;
  RemovedOnInterrupt& operator=(const RemovedOnInterrupt&) = delete;

 private:
  std::filesystem::path folder_;
};

}  // namespace sextant
