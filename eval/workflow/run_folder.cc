#include "sextant/eval/workflow/run_folder.h"

#include "sextant/base/error.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/run_summary.h"
#include "sextant/eval/view/run_report.h"

namespace sextant {
namespace {

/// Merges the options below "noise" over the noise of the configuration.
void set_noise(RunConfig& config) {
  const auto given = config.options.find("noise");
  if (given == config.options.end()) return;
  Json noise = config.noise.options();
  noise.merge_patch(*given);
  config.noise = Noise(noise);
  config.options.erase("noise");
}

}  // namespace

RunConfig run_config(const RunRequest& request, const RunOutput& output) {
  RunConfig config;
  for (const std::string& source : request.sources)
    config.sources.push_back(find_source(source, request.data_root));
  config.estimator = request.estimator;
  config.options = request.options;
  if (request.consistency) config.options["pipeline"]["consistency"] = true;
  const bool with_noise = request.noise == noise_of_procedure;
  if (!with_noise) config.noise = Noise::parse(request.noise);
  config.level = request.level;
  if (!request.procedure.empty()) {
    follow_procedure(request.procedure, with_noise, config);
  } else if (with_noise) {
    fail("--noise procedure takes the noise from a procedure: give --procedure NAME, too");
  }
  set_noise(config);
  config.n_seeds = request.n_seeds;
  config.jobs = request.jobs;
  config.quiet = request.quiet;
  config.folder = std::filesystem::path(output.out) / "external";
  return config;
}

WrittenRun run_into_folder(const RunConfig& config, const RunOutput& output) {
  const MetricPreset& preset = find_preset(output.preset);
  const FolderLock lock(output.out);
  const Json configuration = resolved_configuration(config);
  check_output_folder(output.out, configuration, output.force);

  Json identity = configuration;
  if (const Fingerprints versions = run_fingerprints(config); !versions.empty())
    identity[fingerprints_key] = fingerprints_json(versions);
  RunJournal journal(output.out, identity);
  RunConfig resumable = config;
  if (!config.rescore)
    resumable.journal = &journal;  // the files that a rescored run reads may change between two attempts
  WorstFrames worst(preset);
  resumable.on_pair = [&](const FrameResult& pair, std::span<const Record> of_pair) {
    worst.add(pair, of_pair);
  };
  WrittenRun folder{.result = run(resumable), .warnings = {}};
  const RunResult& result = folder.result;
  const Table summary = summary_table(result.records, preset);
  OutputFiles files = run_files(result);
  try {
    files["report.html"] =
        report_page(run_document({config, result, preset, output.data_root}, worst), config.jobs);
  } catch (const Error& error) {  // a failing gnuplot must not lose the results of a long run
    folder.warnings.push_back(fmt::format("no report.html: {}", error.what()));
    std::error_code ignored;
    std::filesystem::remove(std::filesystem::path(output.out) / "report.html", ignored);
  }
  files["summary.md"] = to_markdown(summary);
  files["summary.csv"] = to_csv(summary);
  write_output_folder(output.out, files);
  journal.remove();
  return folder;
}

RescoredFolder rescore_into_folder(const RescoreRequest& request, const SweepConfig& config,
                                   const RunOutput& output) {
  std::error_code ignored;
  if (std::filesystem::equivalent(request.folder, output.out, ignored))
    fail("--out {}: is the folder that is being rescored: choose another one", output.out);
  if (!is_sweep(request.folder)) {
    RunConfig run = rescored_run(request);
    run.jobs = config.jobs;
    run.quiet = config.quiet;
    return {.run = run_into_folder(run, output), .sweep = {}};
  }
  SweepConfig rescored = rescored_sweep(request);
  rescored.cache = config.cache;
  rescored.jobs = config.jobs;
  rescored.quiet = config.quiet;
  rescored.on_message = config.on_message;
  rescored.out = output.out;
  rescored.replace = output.force;
  return {.run = {}, .sweep = sweep(rescored)};
}

}  // namespace sextant
