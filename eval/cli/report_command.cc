#include <CLI/CLI.hpp>

#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/experiment/output.h"
#include "sextant/eval/experiment/record.h"
#include "sextant/eval/report/noise_levels.h"

namespace sextant {
namespace {

struct ReportFlags : CommonFlags {
  std::vector<std::string> folders;
  std::string out;
};

void report(const ReportFlags& flags) {
  std::vector<Record> records;
  for (const std::string& folder : flags.folders) {
    std::vector<Record> more = read_records(std::filesystem::path(folder) / "records.jsonl");
    std::move(more.begin(), more.end(), std::back_inserter(records));
  }
  const Table table = noise_level_table(noise_levels(records));
  if (!flags.out.empty()) {
    write_output_folder(flags.out, {{"noise_levels.md", to_markdown(table)},
                                    {"noise_levels.csv", to_csv(table)},
                                    {"noise_levels.json", rows_to_json(table).dump(2) + "\n"}});
  }
  if (flags.json) {
    fmt::print("{}\n", rows_to_json(table).dump(2));
  } else if (!flags.quiet) {
    fmt::print("{}", to_text(table));
  }
}

}  // namespace

void add_report_command(CLI::App& app) {
  const auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = app.add_subcommand("report", "Errors by noise level, with intervals, from records");
  command->add_option("dir", flags->folders, "Folders of runs or sweeps")->required()->type_name("DIR");
  command->add_option("--out", flags->out, "Folder for the tables: Markdown, CSV, JSON")->type_name("DIR");
  command->add_flag("--quiet", flags->quiet, "Print nothing");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->footer("Example:\n  sextant report results/runs/depth --out results/runs/depth/report");
  command->callback([flags] { report(*flags); });
}

}  // namespace sextant
