#include <cstdlib>
#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/view/run_report.h"

namespace sextant {
namespace {

struct RunFlags : CommonFlags {
  std::vector<std::string> sources;
  std::string estimator = RunConfig{}.estimator;
  std::string procedure;
  std::string noise = "none";
  bool consistency = false;
  double level = 0;
  int n_seeds = RunConfig{}.n_seeds;
  RunOutput output;
};

constexpr const char* of_procedure = "procedure";

/// What --options and --set say below `noise` goes on top of the noise.
void set_noise(RunConfig& config) {
  const auto said = config.options.find("noise");
  if (said == config.options.end()) return;
  Json noise = config.noise.options();
  noise.merge_patch(*said);
  config.noise = Noise(noise);
  config.options.erase("noise");
}

void run_as_told(RunFlags& flags) {
  flags.output.take(flags);
  RunConfig config;
  for (const std::string& source : flags.sources)
    config.sources.push_back(find_source(source, flags.data_root));
  config.estimator = flags.estimator;
  config.options = options_tree(flags.options, flags.sets);
  if (flags.consistency) config.options["pipeline"]["consistency"] = true;
  const bool noise_of_procedure = flags.noise == of_procedure;
  if (!noise_of_procedure) config.noise = Noise::parse(flags.noise);
  config.level = flags.level;
  if (!flags.procedure.empty()) {
    follow_procedure(flags.procedure, noise_of_procedure, config);
  } else if (noise_of_procedure) {
    fail("--noise procedure: expected --procedure NAME with it");
  }
  set_noise(config);
  config.n_seeds = flags.n_seeds;
  config.jobs = flags.jobs;
  config.quiet = flags.quiet;
  config.folder = std::filesystem::path(flags.output.out) / "external";
  run_and_write(config, flags.output);
}

}  // namespace

void add_run_output_flags(CLI::App& command, RunOutput& output) {
  add_value(command, "--preset", output.preset, "NAME", "Metric preset of the summary of a run")
      ->capture_default_str();
  add_value(command, "--out", output.out, "DIR", "Folder for the results; made if it does not exist")
      ->required();
  add_value(command, "--columns", output.columns, "first|all",
            "Columns of the printed summary: the six that matter first, or all")
      ->capture_default_str()
      ->check(CLI::IsMember({"first", "all"}));
  command.add_flag("--force", output.force, "Replace the results of another run in --out");
}

void RunOutput::take(const CommonFlags& flags) {
  quiet = flags.quiet;
  json = flags.json;
  const char* everywhere = std::getenv("SEXTANT_DATA");
  if (everywhere == nullptr || flags.data_root != everywhere) data_root = flags.data_root;
}

RunResult run_into_folder(const RunConfig& config, const RunOutput& output) {
  const MetricPreset& preset = find_preset(output.preset);
  const FolderLock lock(output.out);
  const Json configuration = resolved_configuration(config);
  check_output_folder(output.out, configuration, output.force);

  Json identity = configuration;
  if (const Fingerprints versions = run_fingerprints(config); !versions.empty())
    identity[fingerprints_key] = fingerprints_json(versions);
  RunJournal journal(output.out, identity);
  RunConfig resumable = config;
  if (!config.rescore) resumable.journal = &journal;  // the files of a rescored run may change between
  WorstFrames worst(preset);
  resumable.on_pair = [&](const FrameResult& pair, std::span<const Record> of_pair) { worst.add(pair, of_pair); };
  RunResult result = run(resumable);
  const Table summary = summary_table(result.records, preset);
  OutputFiles files = run_files(result);
  try {
    files["report.html"] = report_page(run_document({config, result, preset, output.data_root}, worst), config.jobs);
  } catch (const Error& error) {  // the results of hours do not hang on a program that draws
    tell("warning", fmt::format("no report.html: {}", error.what()));
    std::error_code ignored;
    std::filesystem::remove(std::filesystem::path(output.out) / "report.html", ignored);
  }
  files["summary.md"] = to_markdown(summary);
  files["summary.csv"] = to_csv(summary);
  write_output_folder(output.out, files);
  journal.remove();
  return result;
}

void run_and_write(const RunConfig& config, const RunOutput& output) {
  const MetricPreset& preset = find_preset(output.preset);
  const RunResult result = run_into_folder(config, output);
  for (const SourceRun& source : result.sources) {
    if (!output.quiet) warn_of_problems(source.problems);
  }
  if (output.json) {
    Json json = summary_json(result.records, preset);
    json["out"] = output.out;
    fmt::print("{}", json_text(json));
    return;
  }
  for (const SourceRun& source : result.sources) {
    for (const std::string& warning : source.info.warnings) {
      if (!output.quiet) tell("warning", fmt::format("{}: {}", source.source, warning));
    }
  }
  if (!output.quiet) {
    fmt::print("{}\n", summary_text(summary_table(result.records, preset), output.columns == "all"));
    fmt::print("{}", consistency_text(result.records));
  }
  const std::filesystem::path folder = output.out;
  if (!output.quiet && std::filesystem::exists(folder / "report.html")) {
    fmt::print("Report: {}\nWalk through it: sextant view {} --out {}\n", (folder / "report.html").string(),
               shell_word(output.out), shell_word((folder / "view").string()));
  }
  fmt::print("Results: {}\n", output.out);
}

void add_run_command(CLI::App& app) {
  const auto flags = std::make_shared<RunFlags>();
  CLI::App* command =
      app.add_subcommand("run", "Estimate all motions of sources and compare with ground truth");
  add_value(*command, "source", flags->sources, "SOURCE",
            "adapter:path[#sequence][@first-last]; see `sextant data list`")
      ->required();
  add_value(*command, "--estimator", flags->estimator, "NAME", "Which estimator, or external:CONFIG.json")
      ->capture_default_str();
  add_value(*command, "--procedure", flags->procedure, "NAME",
            "Follow somebody else's procedure; --options and --set come on top of it");
  add_option_flags(*command, *flags);
  add_value(*command, "--noise", flags->noise, "JSON|procedure",
            "Noise on the measurements as JSON (docs/noise.md), or that of the procedure")
      ->capture_default_str();
  command->add_flag(
      "--consistency", flags->consistency,
      "Also estimate every body from halves of its points and record how they agree (split_nees)");
  add_value(*command, "--level", flags->level, "NUMBER", "What records call the level of the noise")
      ->capture_default_str();
  add_value(*command, "--seeds", flags->n_seeds, "N", "Repeat with seeds 0..N-1 of the noise")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  add_jobs_flag(*command, *flags);
  add_data_flag(*command, *flags);
  add_run_output_flags(*command, flags->output);
  command->add_flag("--quiet", flags->quiet, "No progress, warnings or table");
  command->add_flag("--json", flags->json, "Print the summary as JSON");
  std::string presets;
  for (const MetricPreset& preset : metric_presets()) {
    presets += fmt::format("  {:<20} {}\n", preset.name, preset.description);
  }
  std::string procedures;
  for (const std::string& name : procedure_names())
    procedures +=
        fmt::format("  {:<20} {}\n", name, find_procedure(name).at("description").get<std::string>());
  command->footer(fmt::format(
      "Estimators (options: `sextant options`):\n{}Presets:\n{}Procedures (motion_only or joint_flow):\n"
      "{}Examples:\n  sextant run vdo:kitti_03_demo@0-19 --estimator joint_flow --out out\n"
      "  sextant run synthetic:s18 --procedure paper_release --noise procedure --seeds 5 --out release",
      estimator_list(), presets, procedures));
  command->callback([flags] { run_as_told(*flags); });
}

}  // namespace sextant
