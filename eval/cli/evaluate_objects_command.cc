#include <CLI/CLI.hpp>

#include <filesystem>
#include <memory>

#include "sextant/base/files.h"
#include "sextant/eval/cli/evaluate.h"
#include "sextant/eval/external/object_evaluation.h"
#include "sextant/eval/external/trajectory_files.h"

namespace sextant {
namespace {

struct ObjectFlags : CommonFlags {
  std::string format, folder, preset, truth, tum;
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

void write_tum(const ObjectLog& log, const ObjectFlags& flags) {
  const std::filesystem::path folder = std::filesystem::path(flags.tum) / log.estimator;
  std::filesystem::create_directories(folder);
  for (const auto& [poses, end] : {std::pair(&log.poses, ""), std::pair(&log.true_poses, "_gt")}) {
    for (auto it = poses->begin(); it != poses->end();
         it = poses->upper_bound({it->first.first, 2'000'000'000})) {
      const int id = it->first.first;
      write_file(folder / fmt::format("obj_{}{}.tum", id, end), tum_of(*poses, id, flags.rate_hz));
    }
  }
}

void evaluate(const ObjectFlags& flags) {
  if (!(flags.rate_hz > 0)) fail("--rate {}: must be above 0", flags.rate_hz);
  std::span<const MetricPreset> presets = metric_presets();
  if (!flags.preset.empty()) presets = {&find_preset(flags.preset), 1};
  std::vector<ObjectLog> logs = read_object_logs(flags.folder, flags.format);
  if (!flags.truth.empty()) {
    SourceSpec spec = find_source(flags.truth, flags.data_root);
    spec.add_options(options_tree(flags.options, flags.sets).value("source", Json::object()));
    const std::unique_ptr<Sequence> sequence = open_source(spec);
    for (ObjectLog& log : logs) take_truth(log, sequence->truth());
  }
  std::vector<Record> records;
  const std::string name = std::filesystem::path(flags.folder).lexically_normal().filename().string();
  for (const ObjectLog& log : logs) {
    std::vector<Record> more = object_records(log, flags.format, name, flags.rate_hz);
    std::move(more.begin(), more.end(), std::back_inserter(records));
    if (!flags.tum.empty()) write_tum(log, flags);
  }
  if (flags.json) {
    fmt::print("{}\n", object_json(records, presets, logs).dump(2));
    return;
  }
  if (flags.quiet) return;
  for (const ObjectLog& log : logs) {
    for (const std::string& text : log.warnings) fmt::print(stderr, "sextant: warning: {}\n", text);
  }
  fmt::print("{}", to_text(object_table(records, presets)));
}

}  // namespace

void add_evaluate_objects_command(CLI::App& evaluate_app) {
  const auto flags = std::make_shared<ObjectFlags>();
  CLI::App* command =
      evaluate_app.add_subcommand("objects", "Object motions of DynOSAM and VDO-SLAM, under every preset");
  command->add_option("DIR", flags->folder, "Folder of logs")->required();
  command->add_option("--format", flags->format, "dynosam or vdo")->required();
  command->add_option("--preset", flags->preset, "One metric preset; default: all side by side");
  command->add_option("--truth", flags->truth,
                      "SOURCE whose true objects replace the log's; ids are matched by overlap");
  command->add_option("--rate", flags->rate_hz, "Frame rate, Hz, for velocities")->capture_default_str();
  add_data_flag(*command, *flags);
  add_option_flags(*command, *flags);
  command->add_option("--save-tum", flags->tum, "Write obj_<id>.tum and obj_<id>_gt.tum per object")
      ->type_name("DIR");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->add_flag("--quiet", flags->quiet, "Print nothing but errors");
  command->footer(
      "Examples:\n  sextant evaluate objects --format dynosam logs/\n"
      "  sextant evaluate objects --format vdo results/ --truth kitti:kitti_tracking#0003 --preset vdo_slam");
  command->callback([flags] { evaluate(*flags); });
}

}  // namespace sextant
