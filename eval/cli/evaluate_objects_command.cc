#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {
namespace {

struct ObjectFlags : CommonFlags {
  ObjectFiles files;
  std::string preset, out;
};

void evaluate(ObjectFlags& flags) {
  const auto lock = lock_folder(flags.out), lock_tum = lock_folder(flags.files.tum);
  std::span<const MetricPreset> presets = metric_presets();
  if (!flags.preset.empty()) presets = {&find_preset(flags.preset), 1};
  flags.files.data_root = flags.data_root;
  flags.files.source_options = options_tree(flags.options, flags.sets);
  const auto [records, folders, warnings, is_comparison] = evaluate_object_files(flags.files);
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
  for (const std::string& text : warnings) tell("warning", text);
  fmt::print("{}", to_text(object_table(records, presets)));
  if (!is_comparison) return;
  fmt::print("\n{}", to_text(object_system_table(records, presets)));
  const Table comparison = object_comparison_table(records, presets);
  if (!comparison.rows.empty()) fmt::print("\n{}", to_text(comparison));
}

}  // namespace

void add_evaluate_objects_command(CLI::App& evaluate_app) {
  const auto flags = std::make_shared<ObjectFlags>();
  CLI::App* command =
      evaluate_app.add_subcommand("objects", "Object motions of DynOSAM and VDO-SLAM, under every preset");
  command
      ->add_option("DIR", flags->files.folders,
                   "Folders of logs, each DIR or SYSTEM=DIR: a run of that system")
      ->required();
  add_choice(*command, "--format", flags->files.format, "Whose logs")->required();
  add_choice(*command, "--stage", flags->files.stage,
             "vdo: the front end's (obj_mot_*) or the batch optimisation's (obj_mot_*_rf*)");
  add_value(*command, "--preset", flags->preset, "NAME", "One metric preset; default: all side by side");
  add_value(*command, "--truth", flags->files.truth, "SOURCE",
            "SOURCE whose true objects replace the log's; ids are matched by overlap");
  command->add_option("--rate", flags->files.rate_hz, "Frame rate, Hz, for velocities")
      ->capture_default_str();
  add_data_flag(*command, *flags);
  add_option_flags(*command, *flags);
  add_value(*command, "--save-tum", flags->files.tum, "DIR",
            "Write obj_<id>.tum and obj_<id>_gt.tum per object");
  add_value(*command, "--out", flags->out, "DIR",
            "Write report.html, tables, figures and records.jsonl here");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->add_flag("--quiet", flags->quiet, "Print nothing but errors");
  command->footer(
      "Examples:\n  sextant evaluate objects --format dynosam logs/\n"
      "  sextant evaluate objects --format vdo results/ --truth kitti:kitti_tracking#0003 --preset vdo_slam\n"
      "  sextant evaluate objects --format dynosam a=run_1/ a=run_2/ b=other_1/ b=other_2/ --out report");
  command->callback([flags] { evaluate(*flags); });
}

}  // namespace sextant
