#pragma once

// The commands of the gate (eval/gate), whose exit code is their result: `compare` also has 1 and 3.

#include "sextant/eval/cli/command.h"

namespace sextant {

/// Ends the program with an exit code that is a result, after everything has been printed.
struct Finished {
  int code = 0;
};

void add_compare_command(CLI::App& app);
void add_trend_command(CLI::App& app);
void add_baseline_command(CLI::App& app);

}  // namespace sextant
