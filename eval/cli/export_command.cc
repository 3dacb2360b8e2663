#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/export/export.h"

namespace sextant {
namespace {

struct ExportFlags : CommonFlags {
  std::string folder, format, out;
};

void export_as_told(const ExportFlags& flags) {
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
      app.add_subcommand("export", "The records of a run or sweep as one file: CSV, numpy, SQLite");
  add_value(*command, "dir", flags->folder, "DIR", "Folder of a run or sweep")->required();
  add_value(*command, "--format", flags->format, "csv|npz|sqlite", "What to write")->required();
  add_value(*command, "--out", flags->out, "FILE", "The file; one that is there is replaced")->required();
  command->add_flag("--quiet", flags->quiet, "No progress, nothing printed");
  command->add_flag("--json", flags->json, "Print the summary as JSON");
  command->footer(
      "One row a record, one column a field: dataset, .., errors_Et_m, values_v_kmh, bound_Et_m, "
      "time_ms_total.\n"
      "Examples:\n  sextant export out --format csv --out records.csv\n"
      "  sextant export out --format sqlite --out records.db");
  command->callback([flags] { export_as_told(*flags); });
}

}  // namespace sextant
