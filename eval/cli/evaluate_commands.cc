#include <CLI/CLI.hpp>

#include "sextant/eval/cli/command.h"

namespace sextant {

void add_evaluate_command(CLI::App& app) {
  CLI::App* evaluate = app.add_subcommand("evaluate", "Recorded results of any system against the truth");
  evaluate->require_subcommand(1);
  evaluate->footer("Example:\n  sextant evaluate ego --format kitti gt.txt estimate.txt --align se3");
  add_evaluate_ego_command(*evaluate);
  add_evaluate_flow_command(*evaluate);
  add_evaluate_depth_command(*evaluate);
  add_evaluate_objects_command(*evaluate);
}

}  // namespace sextant
