#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include <CLI/CLI.hpp>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/evaluation/dense_files.h"
#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/evaluation/ego_report.h"
#include "sextant/eval/workflow/workflow.h"

namespace sextant {
namespace {

struct EgoFlags : CommonFlags {
  EgoFiles files;
  std::string rpe;
  bool all_pairs = false;
  double delta_tolerance = PairSelection{}.relative_tolerance;
  EgoOptions options;
  std::string up, body_from_camera, reference_body_from_camera;
  EgoOutput output;
  std::string covariance, columns = "main";
};

EgoOptions options_of(const EgoFlags& flags) {
  EgoOptions options = flags.options;
  if (!flags.up.empty()) options.up = parse_direction(flags.up);
  if ((options.alignment == Alignment::yaw) != options.up.has_value()) {
    fail(
        "--align yaw and --up go together: --up z where z points up in both worlds (ROS, EuRoC, TUM), "
        "--up -y in opencv axes (KITTI, --axes)");
  }
  if (!flags.body_from_camera.empty())
    options.estimate_frame.body_from_camera = parse_body_from_camera(flags.body_from_camera);
  if (!flags.reference_body_from_camera.empty())
    options.reference_frame.body_from_camera = parse_body_from_camera(flags.reference_body_from_camera);
  if (options.interpolate_max_gap_s && !(*options.interpolate_max_gap_s > 0))
    fail("--interpolate: expected the longest gap to bridge, above 0 s, got {}",
         *options.interpolate_max_gap_s);
  const AssociationOptions& range = options.association;
  if (range.start_s && range.end_s && *range.start_s > *range.end_s)
    fail("--t-start lies after --t-end: expected --t-start <= --t-end");
  if (options.n_to_align > 0 &&
      (options.alignment == Alignment::none || options.alignment == Alignment::origin)) {
    fail("--n-to-align: --align {} is not estimated from several poses: give --align se3, sim3, scale or yaw",
         to_string(options.alignment));
  }
  if (!(options.max_speed_m_s > 0 && std::isfinite(options.max_speed_m_s)))
    fail("--max-speed: expected a finite speed above 0 m/s, got {}", options.max_speed_m_s);
  if (!flags.covariance.empty())
    options.covariance = from_name<CovarianceConvention>(flags.covariance, "--covariance");
  if (!flags.rpe.empty()) {
    for (const std::string& text : split(flags.rpe, ',')) {
      PairSelection& length = options.rpe_lengths.emplace_back(PairSelection::parse(text));
      length.all_pairs = flags.all_pairs;
      length.relative_tolerance = flags.delta_tolerance;
    }
  } else if (flags.all_pairs || options.pairs_from_reference) {
    fail(
        "--all-pairs and --pairs-from-reference select pairs of relative errors: "
        "give --rpe too, e.g. --rpe 1f");
  }
  const bool tolerates =
      flags.all_pairs && std::ranges::any_of(options.rpe_lengths, [](const PairSelection& length) {
        return length.unit != DeltaUnit::frames;
      });
  if (flags.delta_tolerance != PairSelection{}.relative_tolerance && !tolerates) {
    fail(
        "--delta-tolerance selects among all pairs by m, deg, rad or s: give --all-pairs and a --rpe in one "
        "of these units");
  }
  return options;
}

void print(const EgoScores& scores, const EgoOptions& options, const EgoFlags& flags) {
  const auto& [reference, runs] = scores;
  if (flags.json) {
    print_json(ego_json(runs, reference, options));
    return;
  }
  if (flags.quiet) return;
  for (const std::string& text : reference.warnings) print_message("warning", text);
  for (const EgoResult& run : runs) {
    for (const DataWarning& warning : run.warnings) print_message("warning", run.text_of(warning));
  }
  const bool all = flags.columns == "all";
  const Table lengths = ego_length_table(runs, options);
  if (lengths.rows.empty() || all)
    fmt::print("{}", screen_text(ego_error_table(runs, reference, options, !all)));
  if (!lengths.rows.empty()) fmt::print("{}{}", all ? "\n" : "", screen_text(lengths));
  const Table consistency = ego_consistency_table(runs);
  if (!consistency.rows.empty()) fmt::print("\n{}", screen_text(consistency));
  if (all) fmt::print("\n{}", screen_text(ego_step_table(runs, reference)));
  const Table comparison = ego_comparison_table(runs, options);
  if (!comparison.rows.empty()) fmt::print("\n{}", screen_text(comparison));
}

/// Prints the path of the report, where one was requested.
void print_report_path(const std::string& out, const CommonFlags& flags) {
  if (!out.empty() && !flags.json && !flags.quiet)
    fmt::print("\nReport: {}\n", (std::filesystem::path(out) / "report.html").string());
}

void evaluate_ego_with(EgoFlags& flags) {
  const EgoOptions options = options_of(flags);
  flags.files.data_root = flags.data_root;
  flags.files.source_options = options_tree(flags.CommonFlags::options, flags.sets);
  const EgoScores scores = evaluate_ego_into(flags.files, options, flags.output);
  print(scores, options, flags);
  print_report_path(flags.output.out, flags);
}

void add_metric_flags(CLI::App& command, EgoFlags& flags) {
  add_choice(command, "--align", flags.options.alignment, "How an estimate is aligned to the reference");
  add_value(command, "--up", flags.up, "DIRECTION",
            "With --align yaw: the direction up in both worlds: x, y, z, -x, -y, -z or \"X Y Z\"");
  command
      .add_option("--n-to-align", flags.options.n_to_align,
                  "Number of poses, from the start, that se3, sim3, scale and yaw are estimated from; 0: all")
      ->capture_default_str()
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  add_choice(command, "--relation", flags.options.relation,
             "Part of the pose that is compared; point_distance_error_ratio needs --rpe");
  add_value(
      command, "--rpe", flags.rpe, "DISTANCE",
      "Relative errors over this distance: 1f (frames), 10m, 5deg, 0.5rad or 2s; several: 1m,5m,10m,50m");
  command.add_flag("--all-pairs", flags.all_pairs, "All pairs that far apart, not only consecutive ones");
  command
      .add_option("--delta-tolerance", flags.delta_tolerance,
                  "With --all-pairs by m, deg, rad or s: tolerance as a share of the distance")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0))
      ->check(finite_number());
  command.add_flag("--pairs-from-reference", flags.options.pairs_from_reference,
                   "Select the pairs of --rpe on the reference instead of the estimate");
}

void add_association_flags(CLI::App& command, EgoFlags& flags) {
  AssociationOptions& a = flags.options.association;
  command.add_option("--max-difference", a.max_difference_s, "Largest difference of matching time stamps, s")
      ->capture_default_str()
      ->check(finite_number(0));
  command.add_option("--offset", a.offset_s, "Added to the time stamps of the estimate, s")
      ->capture_default_str()
      ->check(finite_number());
  command.add_flag(
      "--estimate-offset", flags.options.estimate_offset,
      "Estimate what to add to the estimate's time stamps, with its 95 % interval, around --offset");
  command
      .add_option("--interpolate", flags.options.interpolate_max_gap_s,
                  "Interpolate the reference at the estimate's time stamps, over gaps up to this, s")
      ->check(finite_number(0));
  command.add_option("--t-start", a.start_s, "First time stamp of the reference to use, s")
      ->check(finite_number());
  command.add_option("--t-end", a.end_s, "Last time stamp of the reference to use, s")
      ->check(finite_number());
}

void add_frame_flags(CLI::App& command, EgoFlags& flags) {
  command.add_flag("--inverse", flags.options.estimate_frame.inverse,
                   "The estimates are inverse poses, T_camera_world");
  command.add_flag("--ref-inverse", flags.options.reference_frame.inverse,
                   "The reference holds inverse poses, T_camera_world");
  add_choice(command, "--axes", flags.options.estimate_frame.axes,
             "Axes of the estimates' worlds and bodies");
  add_choice(command, "--ref-axes", flags.options.reference_frame.axes,
             "Axes of the reference's world and body");
  command
      .add_option("--body-from-camera", flags.body_from_camera,
                  "The estimates are poses of a body: T_body_camera, to be multiplied from the right; "
                  "a file or a text of 16, 12 (matrix row by row) or 3 numbers (position alone, m)")
      ->type_name("FILE|VALUES");
  add_value(command, "--ref-body-from-camera", flags.reference_body_from_camera, "FILE|VALUES",
            "The reference holds poses of a body: T_body_camera, as for --body-from-camera");
}

void add_evaluate_ego_command(CLI::App& evaluate_app) {
  auto [command, flags] = add_command<EgoFlags>(
      evaluate_app, "ego", "Camera trajectories: absolute and relative pose errors", evaluate_ego_with);
  std::string formats;
  for (const TrajectoryFormat& f : trajectory_formats())
    formats += fmt::format("  {:<9} {}\n", f.name, f.description);
  command.add_option("GT", flags.files.reference, "Reference: a file, or a SOURCE with true poses")
      ->required();
  command.add_option(
      "EST", flags.files.estimates,
      "Estimates, each FILE, a system of its own, or SYSTEM=FILE, a run of it; none: those that the log GT "
      "holds beside its truth");
  add_value(command, "--format", flags.files.format, "FORMAT",
            "Format of both; auto: named by the header, or the only format that fits the first record")
      ->capture_default_str();
  add_value(command, "--ref-format", flags.files.reference_format, "FORMAT",
            "Format of the reference, if it differs from --format");
  add_value(command, "--est-format", flags.files.estimate_format, "FORMAT",
            "Format of the estimates, if it differs from --format");
  command.add_option("--rate", flags.files.rate_hz,
                     "Frames per second of files without time stamps: frame k, or row k, is at k / rate");
  add_metric_flags(command, flags);
  add_association_flags(command, flags);
  add_frame_flags(command, flags);
  add_data_flag(command, flags);
  add_option_flags(command, flags);
  add_value(
      command, "--covariance", flags.covariance, "CONVENTION",
      "Convention of covariances behind TUM lines: ros (position first, world axes), openvins (rotation "
      "first, in the body) or gtsam (rotation first, both in the body); without it openvins for 12 numbers, "
      "ros for 21 or 36");
  command
      .add_option("--max-speed", flags.options.max_speed_m_s,
                  "A true step that is faster is an error, m/s (without time stamps: 50 m a frame)")
      ->capture_default_str();
  command
      .add_option("--columns", flags.columns, "main: one table; all: also columns and tables for specialists")
      ->check(CLI::IsMember({"main", "all"}))
      ->capture_default_str();
  add_value(command, "--save-zip", flags.output.zip, "FILE",
            "Write the result as evo does (evo_res reads it)");
  add_value(command, "--save-tum", flags.output.tum, "DIR",
            "Write the matched, aligned trajectories as TUM files");
  add_value(
      command, "--out", flags.output.out, "DIR",
      "Write report.html with paths and errors along them, tables, figures and every curve as CSV here");
  add_choice(command, "--plane", flags.output.plane,
             "Axes of the paths from above; extent: leaves out --up, or the axis of least extent");
  command.add_flag("--json", flags.json, "Print as JSON");
  command.add_flag("--quiet", flags.quiet, "Print nothing but errors");
  command.footer(
      "Formats:\n" + formats +
      "Examples:\n"
      "  sextant evaluate ego --format kitti gt.txt estimate.txt --align se3\n"
      "  sextant evaluate ego --format tum gt.txt estimate.txt --align sim3 --rpe 1s --all-pairs --json\n"
      "  sextant evaluate ego gt.txt estimate.txt --align se3 --rpe 1m,5m,10m,50m --out report\n"
      "  sextant evaluate ego kitti:kitti_tracking#0003 orbslam3.txt --est-format kitti\n"
      "  sextant evaluate ego gt.txt orb=orb_1.txt orb=orb_2.txt vdo=vdo_1.txt vdo=vdo_2.txt\n"
      "  sextant evaluate ego gt.txt orb=orb_1.txt vdo=vdo_1.txt --out report\n"
      "  sextant evaluate ego gt.csv run.bag:/odom --interpolate 0.1 --estimate-offset --align yaw --up z\n"
      "  sextant evaluate ego gt.tum imu.tum --body-from-camera T_body_camera.txt --align se3\n"
      "  sextant evaluate ego --ref-axes ned pose_left.txt orb.tum --rate 10 --align sim3\n"
      "Frames: T_world_camera = C T_world_body T_body_camera, "
      "C from --axes to opencv axes (docs/evaluate.md).\n"
      "Exit codes: 0 done, also with warnings; 2 bad input.");
}

struct ObjectFlags : CommonFlags {
  ObjectFiles files;
  std::string preset, covariance, out;
};

void print(const ObjectScores& scores, const ObjectFlags& flags) {
  for (const std::string& text : scores.warnings) print_message("warning", text);
  fmt::print("{}\n", scores.rate_text());
  if (const std::string text = scores.frame_text(); !text.empty())
    fmt::print("{}\n", wrapped(text, 100, "  "));
  fmt::print("\n");
  const bool all = flags.preset == "all";
  const MetricPreset& one =
      flags.preset.empty() || all ? usual_preset(scores.records) : find_preset(flags.preset);
  const std::span<const MetricPreset> presets = all ? metric_presets() : std::span(&one, 1);
  fmt::print("{}", screen_text(all ? object_table(scores.records, presets)
                                   : object_screen_table(scores.records, one)));
  if (!scores.paths.empty()) fmt::print("\n{}", screen_text(object_path_table(scores.paths)));
  const Table axes = object_axis_table(scores.paths);
  if (all && !axes.rows.empty()) fmt::print("\n{}", screen_text(axes));
  if (!scores.consistency.empty())
    fmt::print("\n{}", screen_text(object_consistency_table(scores.consistency)));
  if (!scores.is_comparison) return;
  fmt::print("\n{}", screen_text(object_system_table(scores.records, presets)));
  const Table comparison = object_comparison_table(scores.records, presets);
  if (!comparison.rows.empty()) fmt::print("\n{}", screen_text(comparison));
}

void evaluate_objects_with(ObjectFlags& flags) {
  std::span<const MetricPreset> presets = metric_presets();
  if (!flags.preset.empty() && flags.preset != "all") presets = {&find_preset(flags.preset), 1};
  if (!flags.covariance.empty())
    flags.files.covariance = from_name<CovarianceConvention>(flags.covariance, "--covariance");
  flags.files.data_root = flags.data_root;
  flags.files.source_options = options_tree(flags.options, flags.sets);
  const ObjectScores scores = evaluate_objects_into(flags.files, presets, flags.out);
  if (flags.json) {
    print_json(object_json(scores, presets));
  } else if (!flags.quiet) {
    print(scores, flags);
  }
  print_report_path(flags.out, flags);
}

void add_evaluate_objects_command(CLI::App& evaluate_app) {
  auto [command, flags] = add_command<ObjectFlags>(
      evaluate_app, "objects", "Logged motions and poses of objects, of DynOSAM, VDO-SLAM or plain files",
      evaluate_objects_with);
  command
      .add_option("DIR", flags.files.folders,
                  "Folders of logs, each DIR or SYSTEM=DIR, one run of that system")
      ->required();
  add_choice(command, "--format", flags.files.format,
             "Format of the logs; motions, poses: one file per object")
      ->required();
  add_choice(command, "--stage", flags.files.stage,
             "vdo: the front end's (obj_mot_*) or the batch optimisation's (obj_mot_*_rf*)");
  add_value(command, "--preset", flags.preset, "NAME",
            "One metric preset, or all; default: all that the log allows, of which the first is printed");
  add_value(command, "--truth", flags.files.truth, "SOURCE",
            "SOURCE whose true objects replace the log's; ids are matched by overlap");
  command
      .add_option(
          "--rate", flags.files.rate_hz,
          "Frame rate, Hz, for velocities; default: of --truth, else of the log's time stamps, else 10")
      ->check(finite_number());
  add_choice(command, "--frame", "The frame of the logged motions; format: body for vdo, else world",
             {"format", "world", "body", "camera"}, "format",
             [&frame = flags.files.frame](const std::string& text) {
               if (text != "format") frame = from_name<MotionFrame>(text, "frame");
             });
  add_choice(command, "--identity", flags.files.identity,
             "Exact identities as estimates of an object that moves: count them as estimates or as lost");
  add_value(
      command, "--covariance", flags.covariance, "CONVENTION",
      "motions, poses: convention of covariances behind TUM rows: ros, openvins or gtsam, as in evaluate "
      "ego");
  add_data_flag(command, flags);
  add_option_flags(command, flags);
  add_value(command, "--save-tum", flags.files.tum, "DIR",
            "Write obj_<id>.tum and obj_<id>_gt.tum per object");
  add_value(command, "--save-zip", flags.files.zip, "DIR",
            "Write the APE of each object with true poses as evo does, obj_<id>.zip (evo_res reads them)");
  add_value(command, "--out", flags.out, "DIR", "Write report.html, tables, figures and records.jsonl here");
  command.add_flag("--json", flags.json, "Print as JSON");
  command.add_flag("--quiet", flags.quiet, "Print nothing but errors");
  command.footer(
      "Examples:\n  sextant evaluate objects --format dynosam logs/\n"
      "  sextant evaluate objects --format vdo results/ --truth kitti:kitti_tracking#0003 --preset vdo_slam\n"
      "  sextant evaluate objects --format motions run/ --truth synthetic:s18\n"
      "  sextant evaluate objects --format dynosam a=run_1/ a=run_2/ b=other_1/ b=other_2/ --out report");
}

template <Named Format>
struct DenseFlags : CommonFlags {
  DenseFiles<Format> files;
  double bf = 0;
};

void print(const Table& table, const std::vector<std::string>& warnings, const CommonFlags& flags) {
  for (const std::string& text : warnings) {
    if (!flags.quiet) print_message("warning", text);
  }
  if (flags.json) {
    print_json(Json({{"schema", 1}, {"rows", rows_to_json(table)}, {"warnings", warnings}}));
  } else if (!flags.quiet) {
    fmt::print("{}", screen_text(table));
  }
}

template <Named Format>
FlaggedCommand<DenseFlags<Format>> add_dense_command(CLI::App& evaluate, const char* name, const char* what,
                                                     Format usual, void (*run)(const DenseFlags<Format>&)) {
  auto [command, flags] = add_command<DenseFlags<Format>>(evaluate, name, what, run);
  DenseFiles<Format>& o = flags.files;
  o.estimate_format = o.truth_format = usual;
  command.add_option("EST", o.estimate, "Image, or folder of images")->required();
  command.add_option("GT", o.truth, "Truth: image, or folder with the same names")->required();
  add_choice(command, "--est-format", o.estimate_format, "Format of the estimate");
  add_choice(command, "--gt-format", o.truth_format, "Format of the truth");
  command.add_option("--mask", o.mask, "Label image (PNG) or folder of them: errors per label");
  command.add_option("--noc", o.visible_truth,
                     "Truth of the pixels visible in both images: errors inside and outside");
  command.add_flag("--json", flags.json, "Print as JSON");
  command.add_flag("--quiet", flags.quiet, "Print nothing but errors");
  return {command, flags};
}

void evaluate_flow_with(const DenseFlags<FlowFormat>& flags) {
  std::vector<std::string> warnings;
  const Table table = evaluate_flow(flags.files, &warnings);
  print(table, warnings, flags);
}

void add_evaluate_flow_command(CLI::App& evaluate) {
  auto [command, flags] = add_dense_command(evaluate, "flow", "Optical flow of whole images",
                                            FlowFormat::by_name, evaluate_flow_with);
  command.footer(
      "Example:\n  sextant evaluate flow 000002_10.flo flow_occ/000002_10.png --gt-format kitti --noc "
      "flow_noc/000002_10.png");
}

void evaluate_depth_with(const DenseFlags<DepthFormat>& flags) {
  std::vector<std::string> warnings;
  const Table table = evaluate_depth(flags.files, flags.bf, &warnings);
  print(table, warnings, flags);
}

void add_evaluate_depth_command(CLI::App& evaluate) {
  auto [command, flags] = add_dense_command(evaluate, "depth", "Depth of whole images", DepthFormat::depth256,
                                            evaluate_depth_with);
  command.add_option("--bf", flags.bf, "Focal length times baseline, px m: for disparities and D1")
      ->check(finite_number(0));
  command.footer(
      "Example:\n  sextant evaluate depth sgbm/ disp_occ_0/ --est-format disparity256 --gt-format "
      "disparity256 --bf 387.57");
}

}  // namespace

void add_evaluate_command(CLI::App& app) {
  CLI::App* evaluate = app.add_subcommand("evaluate", "Recorded results of any system against the truth");
  evaluate->require_subcommand(1);
  evaluate->footer("Example:\n  sextant evaluate ego --format kitti gt.txt estimate.txt --align se3");
  add_evaluate_ego_command(*evaluate);
  add_evaluate_flow_command(*evaluate);
  add_evaluate_depth_command(*evaluate);
  add_evaluate_objects_command(*evaluate);
}

}  // namespace sextant
