#pragma once

// Handling of Ctrl-C. Programs install the handler once; long loops call check_interrupt() between steps,
// which throws Interrupted after a signal. The program then cleans up through destructors and exits with code
// 130.
//
// Code that does not reach check_interrupt() in time, such as a decoder in a library, cannot delay the end: a
// watcher thread ends the program interrupt_grace_s after the signal, as kill -9 would, after removing the
// temporary folders (ScratchFolder in base/new_file.h). All outputs are written so that they survive this
// (docs/security.md). A second signal ends the program at once.

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>

namespace sextant {

class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

/// Installs the handler of SIGINT and SIGTERM. When the watcher ends the program, it prints the line
/// `last_words` to standard error and exits with `exit_code`.
void install_interrupt_handler(std::string last_words, int exit_code);

bool is_interrupted();

void check_interrupt();

/// Time from the signal until the watcher ends the program.
inline constexpr double interrupt_grace_s = 0.6;

/// Calls `create`, which creates a temporary folder and returns its path, and registers the folder, so that
/// the watcher removes it when it ends the program. Once the watcher has begun to remove folders, no further
/// one is created: the call does not return.
std::filesystem::path create_watched_folder(const std::function<std::filesystem::path()>& create);
/// Removes such a folder with its content. In a process that was forked after its creation, the folder stays
/// with the process that created it, here as after a signal.
void remove_watched_folder(const std::filesystem::path& folder);

}  // namespace sextant
