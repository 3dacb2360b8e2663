#include <CLI/CLI.hpp>

#include <filesystem>

#include "sextant/eval/cli/evaluate.h"

namespace sextant {

bool looks_like_source(const std::string& text) {
  const size_t colon = text.find(':');
  if (colon == std::string::npos || colon < 2) return false;
  const std::string adapter = text.substr(0, colon);
  if (adapter.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_") != std::string::npos) return false;
  std::error_code ignored;
  return !std::filesystem::exists(text, ignored);
}

EstimateArgument parse_estimate(const std::string& text) {
  const size_t equals = text.find('=');
  std::error_code ignored;
  if (equals == std::string::npos || equals == 0 || std::filesystem::exists(text, ignored)) return {"", text};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

CLI::App* add_light_evaluate_commands(CLI::App& app, const EgoExtras& extras) {
  CLI::App* evaluate = app.add_subcommand("evaluate", "Recorded results of any system against the truth");
  evaluate->require_subcommand(1);
  evaluate->footer("Example:\n  sextant evaluate ego --format kitti gt.txt estimate.txt --align se3");
  add_evaluate_ego_command(*evaluate, extras);
  add_evaluate_flow_command(*evaluate);
  add_evaluate_depth_command(*evaluate);
  return evaluate;
}

}  // namespace sextant
