#pragma once

// Standard input, output and error of a program that may have been started without them.

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace sextant {

/// Opens /dev/null in place of each of the three that is closed: the next file that is opened would get its number, and
/// what is printed would go into it. To be called before anything is opened.
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
