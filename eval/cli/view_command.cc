#include <filesystem>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/export/export.h"
#include "sextant/eval/pictures/pictures.h"
#include "sextant/eval/view/page.h"
#include "sextant/eval/view/recording.h"

namespace sextant {
namespace {

struct ViewFlags : CommonFlags {
  std::string first, second;
  ViewRequest request;
};

void view(ViewFlags& flags) {
  ViewRequest& request = flags.request;
  request.folders = {flags.first};
  if (!flags.second.empty()) request.folders.emplace_back(flags.second);
  request.data_root = flags.data_root;
  request.page.jobs = flags.jobs;
  request.page.quiet = flags.quiet;
  const View made = make_view(request);
  if (flags.quiet) return;
  for (size_t i = 0; i < made.runs.size(); ++i) {
    const ViewedRun& run = made.runs[i];
    const std::string folder = request.folders[i].string();
    for (const std::string& note : run.notes) print_message("warning", fmt::format("{}: {}", folder, note));
    if (run.n_cases <= 1) continue;
    fmt::print(
        "{}: shows {}, level {}, seed {} of {}, one of {} cases: --source, --estimator, --level, --seed "
        "choose\n",
        folder, run.estimator, run.level, run.seed, run.source, run.n_cases);
  }
  fmt::print("Open in a browser: {}\n", made.page);
}

constexpr const char* default_picture = "overlay.png";

struct OverlayFlags : CommonFlags {
  std::string source;
  std::string out;
  ShowcaseRequest request;
};

void draw_overlays(OverlayFlags& flags) {
  ShowcaseRequest& request = flags.request;
  request.source = find_source(flags.source, flags.data_root);
  request.options = options_tree(flags.options, flags.sets);
  request.jobs = flags.jobs;
  request.quiet = flags.quiet;
  const bool named = !flags.out.empty();
  const std::string out = named ? flags.out : default_picture;
  if (!named && std::filesystem::exists(out)) fail("{}: exists already: give another name with --out", out);
  write_file(out, make_showcase(request).overlay_png);
  if (!flags.quiet) fmt::print("Picture: {}\n", out);
}

struct ExportFlags : CommonFlags {
  std::string folder, format, out, images;
  CaseChoice choice;
  bool no_images = false;
};

/// Writes the recording of one case for other viewers.
void export_recording(const ExportFlags& flags) {
  const ViewedRun run =
      view_folder(flags.folder, flags.choice, flags.images, flags.data_root, flags.jobs, flags.quiet);
  const uint64_t n = write_recording(run, flags.out, {.images = !flags.no_images, .quiet = flags.quiet});
  if (flags.json) {
    print_json(Json{{"out", flags.out}, {"messages", n}});
  } else if (!flags.quiet) {
    for (const std::string& note : run.notes)
      print_message("warning", fmt::format("{}: {}", flags.folder, note));
    fmt::print("{} messages\nResults: {}\n", n, flags.out);
  }
}

/// Throws Error if a flag is given that is for recordings only.
void refuse_recording_flags(const CLI::App& command, const std::string& format) {
  for (const char* flag :
       {"--source", "--estimator", "--level", "--noise", "--seed", "--images", "--no-images"}) {
    if (command.count(flag) > 0)
      fail(
          "{}: is for --format mcap, which holds one case: {} holds every record of the folder, in which the "
          "columns dataset, sequence, estimator, level and seed distinguish the cases",
          flag, format);
  }
}

void export_table(const ExportFlags& flags) {
  const auto format = from_name<ExportFormat>(flags.format, "format");
  const ExportOutcome outcome = export_records(flags.folder, format, flags.out, flags.quiet);
  if (flags.json) {
    print_json(Json{{"out", flags.out}, {"records", outcome.n_records}, {"columns", outcome.n_columns}});
  } else if (!flags.quiet) {
    fmt::print("{} records, {} columns\nResults: {}\n", outcome.n_records, outcome.n_columns, flags.out);
  }
}

void export_folder(const ExportFlags& flags, const CLI::App& command) {
  if (flags.format == "mcap") return export_recording(flags);
  refuse_recording_flags(command, flags.format);
  export_table(flags);
}

}  // namespace

void add_view_command(CLI::App& app) {
  auto [command, flags] =
      add_command<ViewFlags>(app, "view", "Walk through one run, or two side by side, in a browser", view);
  add_value(command, "RUN", flags.first, "DIR",
            "Folder of `sextant run`, `sweep`, `merge` or `evaluate objects --out`")
      ->required();
  add_value(command, "RUN2", flags.second, "DIR",
            "A second folder of the same source, shown beside the first");
  add_value(command, "--out", flags.request.out, "DIR|FILE.html",
            "FILE.html (up to 50 MB), or a folder for index.html and, if larger, frames/")
      ->required();
  add_case_flags(command, flags.request.choice);
  add_value(
      command, "--images,--truth", flags.request.images, "SOURCE",
      "For folders of `evaluate objects`: the SOURCE that the logs belong to, for images, true boxes and "
      "masks");
  command.add_option("--quality", flags.request.page.jpeg_quality, "JPEG quality of the images")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  add_data_flag(command, flags);
  add_jobs_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress and no output");
  command.footer(
      "Examples:\n  sextant run synthetic:city --out city && sextant view city --out city.html\n"
      "  sextant view joint_flow joint_flow_depth --out both.html      # two runs of one source\n"
      "  sextant evaluate objects --format dynosam logs --out scores && sextant view scores --out logs.html\n"
      "  sextant view scores --truth kitti:DIR#0000@0-93 --out logs.html\n"
      "  sextant view sweep --estimator joint_flow --level 0.2 --seed 3 --out case.html");
}

void add_overlay_command(CLI::App& app) {
  auto [command, flags] = add_command<OverlayFlags>(
      app, "overlay", "Draw one frame pair: features, flow, moving objects and their speeds", draw_overlays);
  add_source_argument(command, flags.source);
  add_value(command, "--frame", flags.request.frame, "K",
            "Current frame of the pair; the pipeline runs from the first one. Default: the second frame");
  add_value(command, "--out", flags.out, "FILE.png",
            fmt::format("PNG file. Default: {}, which is then never overwritten", default_picture));
  command.add_option("--width", flags.request.width_px, "Width of the picture in px; 0 = twice the image's")
      ->check(CLI::Range(0, 20000));
  add_value(command, "--estimator", flags.request.estimator, "NAME", "Which estimator")
      ->capture_default_str();
  add_option_flags(command, flags);
  add_jobs_flag(command, flags);
  add_data_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress and no output");
  command.footer("Example:\n  sextant overlay synthetic:s18 --frame 5 --out overlay.png");
}

void add_export_command(CLI::App& app) {
  auto [command, flags] = add_command<ExportFlags>(
      app, "export", "A run or sweep as one file for other programs: CSV, numpy, SQLite, MCAP",
      export_folder);
  add_value(command, "dir", flags.folder, "DIR", "Folder of a run or sweep")->required();
  add_value(command, "--format", flags.format, "csv|npz|sqlite|mcap", "Format of the file")->required();
  add_value(command, "--out", flags.out, "FILE", "The file; an existing one is replaced")->required();
  add_case_flags(command, flags.choice);
  add_value(command, "--images", flags.images, "SOURCE",
            "mcap, for folders of `evaluate objects`: the SOURCE that the logs belong to");
  command.add_flag("--no-images", flags.no_images, "mcap: poses, paths and boxes only");
  add_data_flag(command, flags);
  add_jobs_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress, nothing printed");
  command.add_flag("--json", flags.json, "Print the summary as JSON");
  command.footer(
      "csv, npz and sqlite: one row per record of all cases, one column per field (dataset, ..,\n"
      "errors_Et_m, values_v_kmh, bound_Et_m, time_ms_total). mcap: poses, paths, object boxes and\n"
      "images of one case as a recording for Foxglove; --source, --estimator, --level and --seed\n"
      "choose the case, and are refused for the other formats.\n"
      "Examples:\n  sextant export out --format csv --out records.csv\n"
      "  sextant export out --format sqlite --out records.db\n"
      "  sextant export out --format mcap --out run.mcap");
}

}  // namespace sextant
