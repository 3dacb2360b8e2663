#include <cstdlib>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/workflow/workflow.h"

namespace sextant {
namespace {

struct OutputFlags : CommonFlags {
  RunOutput output;
  std::string columns = "first";

  void take_common() {
    const char* everywhere = std::getenv("SEXTANT_DATA");
    if (everywhere == nullptr || data_root != everywhere) output.data_root = data_root;
  }
};

struct RunFlags : OutputFlags {
  RunRequest request;
};

struct RescoreFlags : OutputFlags {
  std::string folder, config, cache;
};

/// Returns the first of run-1, run-2, .. that does not exist in the working folder.
std::string new_run_folder() {
  int n = 1;
  while (std::filesystem::exists(fmt::format("run-{}", n))) ++n;
  return fmt::format("run-{}", n);
}

/// Adds the flags of the output; `out_help` explains --out, which it returns.
CLI::Option* add_run_output_flags(CLI::App& command, OutputFlags& flags, const std::string& out_help) {
  add_value(command, "--preset", flags.output.preset, "NAME", "Metric preset of the summary of a run")
      ->capture_default_str();
  CLI::Option* out = add_value(command, "--out", flags.output.out, "DIR", out_help);
  add_value(command, "--columns", flags.columns, "first|all",
            "Columns of the printed summary: the six that matter first, or all")
      ->capture_default_str()
      ->check(CLI::IsMember({"first", "all"}));
  command.add_flag("--force", flags.output.force, "Replace the results of another run in --out");
  return out;
}

void print_run(const WrittenRun& folder, const OutputFlags& flags) {
  const RunResult& result = folder.result;
  const std::string& out = flags.output.out;
  const MetricPreset& preset = find_preset(flags.output.preset);
  for (const std::string& warning : folder.warnings) print_message("warning", warning);
  for (const SourceRun& source : result.sources) {
    if (!flags.quiet) warn_of_problems(source.problems);
  }
  if (flags.json) {
    Json json = summary_json(result.records, preset);
    json["out"] = out;
    print_json(json);
    return;
  }
  for (const SourceRun& source : result.sources) {
    for (const std::string& warning : source.info.all_warnings()) {
      if (!flags.quiet) print_message("warning", fmt::format("{}: {}", source.source, warning));
    }
  }
  if (!flags.quiet) {
    fmt::print("{}\n", summary_text(result.records, preset, flags.columns == "all"));
    fmt::print("{}", consistency_text(result.records));
  }
  const std::filesystem::path path = out;
  if (!flags.quiet && folder.warnings.empty()) {
    fmt::print("Report: {}\nWalk through it: sextant view {} --out {}\n", (path / "report.html").string(),
               shell_word(out), shell_word((path / "view").string()));
  }
  fmt::print("Results: {}\n", out);
}

void run_with_flags(RunFlags& flags, const CLI::App& command) {
  if (command.count("--out") == 0) flags.output.out = new_run_folder();
  flags.take_common();
  RunRequest& request = flags.request;
  request.data_root = flags.data_root;
  request.options = options_tree(flags.options, flags.sets);
  request.jobs = flags.jobs;
  request.quiet = flags.quiet;
  const RunConfig config = run_config(request, flags.output);
  const WrittenRun folder = run_into_folder(config, flags.output);
  if (!flags.quiet) {
    for (const std::string& warning : noise_warnings(request, config)) print_message("warning", warning);
  }
  print_run(folder, flags);
}

void rescore(RescoreFlags& flags) {
  flags.take_common();
  SweepConfig config;
  set_common(flags.cache, flags, config);
  const RescoredFolder rescored = rescore_into_folder(
      {flags.folder, flags.config, options_tree(flags.options, flags.sets), flags.data_root}, config,
      flags.output);
  if (rescored.sweep) print_sweep(*rescored.sweep, flags.output.out, flags);
  if (rescored.run) print_run(*rescored.run, flags);
}

}  // namespace

void add_run_command(CLI::App& app) {
  auto [command, flags] = add_command<RunFlags>(
      app, "run", "Estimate all motions of sources and compare with ground truth", run_with_flags);
  RunRequest& request = flags.request;
  add_value(command, "source", request.sources, "SOURCE",
            "adapter:path[#sequence][@first-last]; see `sextant data list`")
      ->required();
  add_value(command, "--estimator", request.estimator, "NAME", "Which estimator, or external:CONFIG.json")
      ->capture_default_str();
  add_value(command, "--procedure", request.procedure, "NAME",
            "Evaluate by the procedure of a publication or release; --options and --set come on top of it");
  add_option_flags(command, flags);
  add_value(command, "--noise", request.noise, "JSON|procedure",
            "Noise on the measurements as JSON (docs/noise.md), or \"procedure\": the noise of --procedure")
      ->capture_default_str();
  command.add_flag(
      "--consistency", request.consistency,
      "Also estimate every body from each half of its points and record how well the two agree (split_nees)");
  add_value(command, "--level", request.level, "NUMBER", "Noise level that the records state")
      ->capture_default_str();
  add_value(command, "--seeds", request.n_seeds, "N", "Repeat with seeds 0..N-1 of the noise")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  add_jobs_flag(command, flags);
  add_data_flag(command, flags);
  add_run_output_flags(command, flags,
                       "Folder for the results; made if it does not exist; default: a new folder run-N");
  command.add_flag("--quiet", flags.quiet, "No progress, warnings or table");
  command.add_flag("--json", flags.json, "Print the summary as JSON");
  std::string presets;
  for (const MetricPreset& preset : metric_presets()) {
    presets += fmt::format("  {:<20} {}\n", preset.name, preset.description);
  }
  std::string procedures;
  for (const std::string& name : procedure_names())
    procedures +=
        fmt::format("  {:<20} {}\n", name, find_procedure(name).at("description").get<std::string>());
  command.footer(fmt::format(
      "Estimators (options: `sextant options`):\n{}Presets:\n{}Procedures (motion_only or joint_flow):\n"
      "{}Examples:\n  sextant run vdo:kitti_03_demo@0-19 --estimator joint_flow --out out\n"
      "  sextant run synthetic:s18 --procedure paper_release --noise procedure --seeds 5 --out release",
      estimator_list(), presets, procedures));
}

void add_rescore_command(CLI::App& app) {
  auto [command, flags] = add_command<RescoreFlags>(
      app, "rescore", "Score again what external programs left in a run or sweep, without running them",
      rescore);
  add_value(command, "dir", flags.folder, "OUT", "Folder of a finished run or sweep; it is only read")
      ->required();
  add_value(command, "--config", flags.config, "CONFIG.json", "Configuration in place of the recorded one");
  add_option_flags(command, flags);
  add_cache_flag(command, flags.cache);
  add_jobs_flag(command, flags);
  add_data_flag(command, flags);
  add_run_output_flags(command, flags, "Folder for the results; made if it does not exist")->required();
  command.add_flag("--quiet", flags.quiet, "No progress, warnings or table");
  command.add_flag("--json", flags.json, "Print the summary as JSON");
  command.footer(
      "Examples:\n  sextant rescore out --set estimator.objects.stage=refined --out refined\n"
      "  sextant rescore sweep --config corrected.json --out corrected");
}

}  // namespace sextant
