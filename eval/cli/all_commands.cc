#include <array>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/external/external_estimator.h"

namespace sextant {

namespace {

constexpr auto command_table = std::to_array<AddCommand>({
    add_data_command,
    add_run_command,
    add_rescore_command,
    add_sweep_command,
    add_merge_command,
    add_report_command,
    add_reproduce_command,
    add_compare_command,
    add_trend_command,
    add_baseline_command,
    add_evaluate_command,
    add_overlay_command,
    add_noise_command,
    add_view_command,
    add_export_command,
    add_explain_command,
    add_cache_command,
    add_options_command,
    add_completion_command,
    add_man_command,
    add_help_command,
});

}  // namespace

int program(int argc, const char* const* argv) {
  add_external_estimators();
  return program(argc, argv, command_table);
}

}  // namespace sextant
