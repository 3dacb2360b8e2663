#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/external/rescore.h"

namespace sextant {
namespace {

struct RescoreFlags : CommonFlags {
  std::string folder, config, cache;
  RunOutput output;
};

void rescore(RescoreFlags& flags) {
  flags.output.take(flags);
  std::error_code ignored;
  if (std::filesystem::equivalent(flags.folder, flags.output.out, ignored))
    fail("--out {}: is the folder itself: choose another one", flags.output.out);
  const RescoreRequest request = {flags.folder, flags.config, options_tree(flags.options, flags.sets),
                                  flags.data_root};
  if (is_sweep(flags.folder)) {
    SweepConfig config = rescored_sweep(request);
    config.cache = cache_of(flags.cache);
    config.jobs = flags.jobs;
    config.quiet = flags.quiet;
    config.out = flags.output.out;
    config.replace = flags.output.force;
    sweep_and_print(config, flags.json);
    return;
  }
  RunConfig config = rescored_run(request);
  config.jobs = flags.jobs;
  config.quiet = flags.quiet;
  run_and_write(config, flags.output);
}

}  // namespace

void add_rescore_command(CLI::App& app) {
  const auto flags = std::make_shared<RescoreFlags>();
  CLI::App* command = app.add_subcommand(
      "rescore", "Score again what external programs left in a run or sweep, without running them");
  add_value(*command, "dir", flags->folder, "OUT", "Folder of a finished run or sweep; it is only read")
      ->required();
  add_value(*command, "--config", flags->config, "CONFIG.json", "Configuration in place of the recorded one");
  add_option_flags(*command, *flags);
  add_cache_flag(*command, flags->cache);
  add_jobs_flag(*command, *flags);
  add_data_flag(*command, *flags);
  add_run_output_flags(*command, flags->output);
  command->add_flag("--quiet", flags->quiet, "No progress, warnings or table");
  command->add_flag("--json", flags->json, "Print the summary as JSON");
  command->footer(
      "Examples:\n  sextant rescore out --set estimator.objects.stage=refined --out refined\n"
      "  sextant rescore sweep --config corrected.json --out corrected");
  command->callback([flags] { rescore(*flags); });
}

}  // namespace sextant
