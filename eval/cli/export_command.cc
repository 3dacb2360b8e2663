#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/export/export.h"
#include "sextant/eval/view/recording.h"

namespace sextant {
namespace {

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
    fmt::print("{}", json_text(Json{{"out", flags.out}, {"messages", n}}));
  } else if (!flags.quiet) {
    for (const std::string& note : run.notes)
      print_message("warning", fmt::format("{}: {}", flags.folder, note));
    fmt::print("{} messages\nResults: {}\n", n, flags.out);
  }
}

void export_table(const ExportFlags& flags) {
  const auto format = from_name<ExportFormat>(flags.format, "format");
  const ExportOutcome outcome = export_records(flags.folder, format, flags.out, flags.quiet);
  if (flags.json) {
    fmt::print(
        "{}",
        json_text(Json{{"out", flags.out}, {"records", outcome.n_records}, {"columns", outcome.n_columns}}));
  } else if (!flags.quiet) {
    fmt::print("{} records, {} columns\nResults: {}\n", outcome.n_records, outcome.n_columns, flags.out);
  }
}

}  // namespace

void add_export_command(CLI::App& app) {
  const auto flags = std::make_shared<ExportFlags>();
  CLI::App* command =
      app.add_subcommand("export", "A run or sweep as one file for other programs: CSV, numpy, SQLite, MCAP");
  add_value(*command, "dir", flags->folder, "DIR", "Folder of a run or sweep")->required();
  add_value(*command, "--format", flags->format, "csv|npz|sqlite|mcap", "Format of the file")->required();
  add_value(*command, "--out", flags->out, "FILE", "The file; an existing one is replaced")->required();
  add_case_flags(*command, flags->choice);
  add_value(*command, "--images", flags->images, "SOURCE",
            "mcap, for folders of `evaluate objects`: the SOURCE that the logs belong to");
  command->add_flag("--no-images", flags->no_images, "mcap: poses, paths and boxes only");
  add_data_flag(*command, *flags);
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress, nothing printed");
  command->add_flag("--json", flags->json, "Print the summary as JSON");
  command->footer(
      "csv, npz and sqlite: one row per record, one column per field (dataset, .., errors_Et_m,\n"
      "values_v_kmh, bound_Et_m, time_ms_total). mcap: poses, paths, object boxes and images of one\n"
      "case as a recording for Foxglove; --source, --estimator, --level and --seed choose the case.\n"
      "Examples:\n  sextant export out --format csv --out records.csv\n"
      "  sextant export out --format sqlite --out records.db\n"
      "  sextant export out --format mcap --out run.mcap");
  command->callback([flags] { flags->format == "mcap" ? export_recording(*flags) : export_table(*flags); });
}

}  // namespace sextant
