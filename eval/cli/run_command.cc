#include <CLI/CLI.hpp>

#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/experiment/interrupt.h"
#include "sextant/eval/experiment/output.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/report/summary.h"

namespace sextant {
namespace {

struct RunFlags : CommonFlags {
  std::vector<std::string> sources;
  std::string estimator = RunConfig{}.estimator;
  std::string preset = "paper";
  std::string noise = "none";
  double level = 0;
  int n_seeds = RunConfig{}.n_seeds;
  std::string out;
  bool force = false;
};

void run_and_write(const RunFlags& flags) {
  const MetricPreset& preset = find_preset(flags.preset);
  RunConfig config;
  for (const std::string& source : flags.sources)
    config.sources.push_back(find_source(source, flags.data_root));
  config.estimator = flags.estimator;
  config.options = options_tree(flags.options, flags.sets);
  config.noise = Noise::parse(flags.noise);
  config.level = flags.level;
  config.n_seeds = flags.n_seeds;
  config.jobs = flags.jobs;
  config.quiet = flags.quiet;
  config.folder = std::filesystem::path(flags.out) / "external";
  check_output_folder(flags.out, resolved_configuration(config), flags.force);

  const RunResult result = run(config);
  const Table summary = summary_table(result.records, preset);
  OutputFiles files = run_files(result);
  files["summary.md"] = to_markdown(summary);
  files["summary.csv"] = to_csv(summary);
  write_output_folder(flags.out, files);

  for (const SourceRun& source : result.sources) {
    if (!flags.quiet) warn_of_problems(source.problems);
  }
  if (flags.json) {
    Json json = summary_json(result.records, preset);
    json["out"] = flags.out;
    fmt::print("{}", json_text(json));
    return;
  }
  for (const SourceRun& source : result.sources) {
    for (const std::string& warning : source.info.warnings) {
      if (!flags.quiet) fmt::print(stderr, "sextant: warning: {}: {}\n", source.source, warning);
    }
  }
  if (!flags.quiet) fmt::print("{}\n", to_text(summary));
  fmt::print("Results: {}\n", flags.out);
}

}  // namespace

void add_run_command(CLI::App& app) {
  const auto flags = std::make_shared<RunFlags>();
  CLI::App* command =
      app.add_subcommand("run", "Estimate all motions of sources and compare with ground truth");
  command
      ->add_option("source", flags->sources, "adapter:path[#sequence][@first-last]; see `sextant data list`")
      ->required()
      ->type_name("SOURCE");
  command->add_option("--estimator", flags->estimator, "Which estimator, or external:CONFIG.json")
      ->type_name("NAME")
      ->capture_default_str();
  add_option_flags(*command, *flags);
  command->add_option("--noise", flags->noise, "Noise on the measurements as JSON; see docs/noise.md")
      ->type_name("JSON")
      ->capture_default_str();
  command->add_option("--level", flags->level, "What records call the level of the noise")
      ->type_name("NUMBER")
      ->capture_default_str();
  command->add_option("--seeds", flags->n_seeds, "Repeat with seeds 0..N-1 of the noise")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  command->add_option("--preset", flags->preset, "Metric preset of the summary")
      ->type_name("NAME")
      ->capture_default_str();
  add_jobs_flag(*command, *flags);
  add_data_flag(*command, *flags);
  command->add_option("--out", flags->out, "Folder for the results; made if it does not exist")
      ->required()
      ->type_name("DIR");
  command->add_flag("--force", flags->force, "Replace the results of another run in --out");
  command->add_flag("--quiet", flags->quiet, "No progress, warnings or table");
  command->add_flag("--json", flags->json, "Print the summary as JSON");
  std::string presets;
  for (const MetricPreset& preset : metric_presets()) {
    presets += fmt::format("  {:<20} {}\n", preset.name, preset.description);
  }
  command->footer(
      fmt::format("Estimators (options: `sextant options`):\n{}Presets:\n{}"
                  "Example:\n  sextant run vdo:kitti_03_demo@0-19 --estimator joint_flow --out out",
                  estimator_list(), presets));
  command->callback([flags] { run_and_write(*flags); });
}

}  // namespace sextant
