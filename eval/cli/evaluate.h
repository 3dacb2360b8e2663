#pragma once

// The subcommands of `sextant evaluate`.

#include "sextant/eval/cli/command.h"

namespace sextant {

void add_evaluate_ego_command(CLI::App& evaluate);
void add_evaluate_objects_command(CLI::App& evaluate);
void add_evaluate_flow_command(CLI::App& evaluate);
void add_evaluate_depth_command(CLI::App& evaluate);

}  // namespace sextant
