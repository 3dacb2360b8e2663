#pragma once

// Ctrl-C. Programs install the handler once; long loops call check_interrupt() between steps, which throws
// Interrupted after the signal; the program then cleans up through destructors and exits with code 130.
// A second signal ends the program at once.

#include <stdexcept>

namespace sextant {

class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

/// For SIGINT and SIGTERM.
void install_interrupt_handler();

void check_interrupt();

}  // namespace sextant
