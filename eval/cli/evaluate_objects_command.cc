#include <CLI/CLI.hpp>

#include <cmath>
#include <filesystem>
#include <memory>

#include "sextant/base/files.h"
#include "sextant/eval/cli/evaluate.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/object_report.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/html/report_folder.h"

namespace sextant {
namespace {

struct ObjectFlags : CommonFlags {
  std::vector<std::string> folders;
  std::string format, stage = "any", preset, truth, tum, out;
  double rate_hz = 10;
};

std::string tum_of(const std::map<ObjectFrame, SE3>& poses, int id, double rate_hz) {
  PoseSeries series;
  for (auto it = poses.lower_bound({id, 0}); it != poses.end() && it->first.first == id; ++it) {
    series.add(it->second.rotation().toRotationMatrix(), it->second.translation());
    series.stamps_s.push_back(it->first.second / rate_hz);
  }
  return encode_tum(series);
}

/// <DIR>/<system>, of the second and later runs of a system <DIR>/<system>_2 ...
void write_tum(ObjectLog& log, int run_of_system, const ObjectFlags& flags) {
  if (log.poses.empty()) log.poses = chained_poses(log);
  if (log.poses.empty()) {
    log.warnings.push_back(fmt::format(
        "--save-tum: the log of {} holds motions of objects, but no pose to start from: give --truth",
        log.estimator));
  }
  const std::string end_of_name = run_of_system > 1 ? fmt::format("_{}", run_of_system) : "";
  const std::filesystem::path folder = std::filesystem::path(flags.tum) / (log.estimator + end_of_name);
  std::filesystem::create_directories(folder);
  for (const auto& [poses, end] : {std::pair(&log.poses, ""), std::pair(&log.true_poses, "_gt")}) {
    for (auto it = poses->begin(); it != poses->end();
         it = poses->upper_bound({it->first.first, 2'000'000'000})) {
      const int id = it->first.first;
      write_file(folder / fmt::format("obj_{}{}.tum", id, end), tum_of(*poses, id, flags.rate_hz));
    }
  }
}

/// The logs of one folder; those of SYSTEM=DIR under that name, with the module where there are several.
std::vector<ObjectLog> logs_of(const EstimateArgument& argument, const ObjectFlags& flags) {
  std::vector<ObjectLog> logs = read_object_logs(argument.path, {flags.format, flags.stage});
  for (ObjectLog& log : logs) {
    if (argument.system.empty()) continue;
    log.estimator = logs.size() == 1 ? argument.system : argument.system + "_" + log.estimator;
  }
  return logs;
}

/// The truth within the frames that SOURCE@first-last asks for.
SequenceTruth source_truth(const ObjectFlags& flags) {
  SourceSpec spec = find_source(flags.truth, flags.data_root);
  spec.add_options(options_tree(flags.options, flags.sets).value("source", Json::object()));
  const std::unique_ptr<Sequence> sequence = open_source(spec);
  SequenceTruth truth = sequence->truth();
  std::erase_if(truth.objects, [&](const auto& at) {
    return at.first < sequence->info().first_frame || at.first > sequence->info().last_frame;
  });
  if (truth.objects.empty()) fail("{}: has no true objects to compare with", flags.truth);
  return truth;
}

void evaluate(const ObjectFlags& flags) {
  if (!(flags.rate_hz > 0) || !std::isfinite(flags.rate_hz))
    fail("--rate {}: must be above 0", flags.rate_hz);
  std::span<const MetricPreset> presets = metric_presets();
  if (!flags.preset.empty()) presets = {&find_preset(flags.preset), 1};
  std::optional<SequenceTruth> truth;
  if (!flags.truth.empty()) truth = source_truth(flags);
  std::vector<Record> records;
  std::vector<std::string> folders, warnings;
  std::map<std::string, int> runs;
  for (const std::string& text : flags.folders) {
    const EstimateArgument argument = parse_estimate(text);
    folders.push_back(argument.path);
    const std::string name = std::filesystem::path(argument.path).lexically_normal().filename().string();
    for (ObjectLog& log : logs_of(argument, flags)) {
      if (truth) take_truth(log, *truth);
      const int run = runs[log.estimator]++;
      std::ranges::move(object_records(log, flags.format, name, flags.rate_hz, static_cast<uint64_t>(run)),
                        std::back_inserter(records));
      if (!flags.tum.empty()) write_tum(log, run + 1, flags);
      std::ranges::move(log.warnings, std::back_inserter(warnings));
    }
  }
  if (!flags.out.empty()) {
    OutputFiles files = report_folder(object_document(records, presets, folders, warnings), {});
    files["records.jsonl"] = write_records(records);
    write_output_folder(flags.out, files);
  }
  if (flags.json) {
    fmt::print("{}", json_text(object_json(records, presets, warnings)));
    return;
  }
  if (flags.quiet) return;
  for (const std::string& text : warnings) fmt::print(stderr, "sextant: warning: {}\n", text);
  fmt::print("{}", to_text(object_table(records, presets)));
  if (folders.size() < 2 && runs.size() < 2) return;
  fmt::print("\n{}", to_text(object_system_table(records, presets)));
  const Table comparison = object_comparison_table(records, presets);
  if (!comparison.rows.empty()) fmt::print("\n{}", to_text(comparison));
}

}  // namespace

void add_evaluate_objects_command(CLI::App& evaluate_app) {
  const auto flags = std::make_shared<ObjectFlags>();
  CLI::App* command =
      evaluate_app.add_subcommand("objects", "Object motions of DynOSAM and VDO-SLAM, under every preset");
  command->add_option("DIR", flags->folders, "Folders of logs, each DIR or SYSTEM=DIR: a run of that system")
      ->required();
  command->add_option("--format", flags->format, "dynosam or vdo")->required();
  command
      ->add_option("--stage", flags->stage,
                   "vdo: initial (obj_mot_*) or refined (obj_mot_*_rf*) where a folder holds both")
      ->type_name("STAGE")
      ->capture_default_str();
  command->add_option("--preset", flags->preset, "One metric preset; default: all side by side");
  command->add_option("--truth", flags->truth,
                      "SOURCE whose true objects replace the log's; ids are matched by overlap");
  command->add_option("--rate", flags->rate_hz, "Frame rate, Hz, for velocities")->capture_default_str();
  add_data_flag(*command, *flags);
  add_option_flags(*command, *flags);
  command->add_option("--save-tum", flags->tum, "Write obj_<id>.tum and obj_<id>_gt.tum per object")
      ->type_name("DIR");
  command->add_option("--out", flags->out, "Write report.html, tables, figures and records.jsonl here")
      ->type_name("DIR");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->add_flag("--quiet", flags->quiet, "Print nothing but errors");
  command->footer(
      "Examples:\n  sextant evaluate objects --format dynosam logs/\n"
      "  sextant evaluate objects --format vdo results/ --truth kitti:kitti_tracking#0003 --preset vdo_slam\n"
      "  sextant evaluate objects --format dynosam a=run_1/ a=run_2/ b=other_1/ b=other_2/ --out report");
  command->callback([flags] { evaluate(*flags); });
}

}  // namespace sextant
