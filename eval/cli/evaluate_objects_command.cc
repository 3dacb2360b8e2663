#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/evaluation/recorded_files.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {
namespace {

struct ObjectFlags : CommonFlags {
  ObjectFiles files;
  std::string preset, covariance, out;
};

void print(const ObjectScores& scores, const ObjectFlags& flags) {
  for (const std::string& text : scores.warnings) tell("warning", text);
  fmt::print("{}\n\n", scores.rate_text());
  const bool all = flags.preset == "all";
  const MetricPreset& one =
      flags.preset.empty() || all ? usual_preset(scores.records) : find_preset(flags.preset);
  const std::span<const MetricPreset> presets = all ? metric_presets() : std::span(&one, 1);
  fmt::print("{}", to_text(all ? object_table(scores.records, presets) : object_screen_table(scores.records, one)));
  if (!scores.paths.empty()) fmt::print("\n{}", to_text(object_path_table(scores.paths)));
  const Table axes = object_axis_table(scores.paths);
  if (all && !axes.rows.empty()) fmt::print("\n{}", to_text(axes));
  if (!scores.consistency.empty()) fmt::print("\n{}", to_text(object_consistency_table(scores.consistency)));
  if (!scores.is_comparison) return;
  fmt::print("\n{}", to_text(object_system_table(scores.records, presets)));
  const Table comparison = object_comparison_table(scores.records, presets);
  if (!comparison.rows.empty()) fmt::print("\n{}", to_text(comparison));
}

void evaluate(ObjectFlags& flags) {
  const auto lock = lock_folder(flags.out), lock_tum = lock_folder(flags.files.tum);
  std::span<const MetricPreset> presets = metric_presets();
  if (!flags.preset.empty() && flags.preset != "all") presets = {&find_preset(flags.preset), 1};
  if (!flags.covariance.empty())
    flags.files.covariance = from_name<CovarianceConvention>(flags.covariance, "--covariance");
  flags.files.data_root = flags.data_root;
  flags.files.source_options = options_tree(flags.options, flags.sets);
  const ObjectScores scores = evaluate_object_files(flags.files);
  if (!flags.out.empty()) {
    OutputFiles files = report_folder(object_document(scores, presets), {});
    files["records.jsonl"] = write_records(scores.records);
    write_output_folder(flags.out, files);
  }
  if (flags.json) {
    fmt::print("{}", json_text(object_json(scores, presets)));
  } else if (!flags.quiet) {
    print(scores, flags);
  }
}

}  // namespace

void add_evaluate_objects_command(CLI::App& evaluate_app) {
  const auto flags = std::make_shared<ObjectFlags>();
  CLI::App* command =
      evaluate_app.add_subcommand("objects", "Logged motions and poses of objects, of DynOSAM, VDO-SLAM or plain files");
  command
      ->add_option("DIR", flags->files.folders,
                   "Folders of logs, each DIR or SYSTEM=DIR: a run of that system")
      ->required();
  add_choice(*command, "--format", flags->files.format, "Whose logs; motions, poses: one file an object")->required();
  add_choice(*command, "--stage", flags->files.stage,
             "vdo: the front end's (obj_mot_*) or the batch optimisation's (obj_mot_*_rf*)");
  add_value(*command, "--preset", flags->preset, "NAME", "One metric preset, or all; printed without: the first that the log allows");
  add_value(*command, "--truth", flags->files.truth, "SOURCE",
            "SOURCE whose true objects replace the log's; ids are matched by overlap");
  command->add_option("--rate", flags->files.rate_hz,
                      "Frame rate, Hz, for velocities; default: of --truth, else of the log's time stamps, else 10")
      ->check(finite_number());
  add_choice(*command, "--frame", "The frame of the logged motions; format: body for vdo, else world",
             {"format", "world", "body", "camera"}, "format", [flags](const std::string& text) {
               if (text != "format") flags->files.frame = from_name<MotionFrame>(text, "frame");
             });
  add_choice(*command, "--identity", flags->files.identity,
             "Exact identities as estimates of an object that moves: count them as estimates or as lost");
  add_value(*command, "--covariance", flags->covariance, "CONVENTION",
            "motions, poses: of covariances behind TUM rows: ros, openvins or gtsam, as in evaluate ego");
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
      "  sextant evaluate objects --format motions run/ --truth synthetic:s18\n"
      "  sextant evaluate objects --format dynosam a=run_1/ a=run_2/ b=other_1/ b=other_2/ --out report");
  command->callback([flags] { evaluate(*flags); });
}

}  // namespace sextant
