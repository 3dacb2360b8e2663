#include <CLI/CLI.hpp>

#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/experiment/output.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/comparisons.h"
#include "sextant/eval/report/figures/noise_figures.h"
#include "sextant/eval/report/noise_levels.h"
#include "sextant/eval/report/trends.h"

namespace sextant {
namespace {

struct ReportFlags : CommonFlags {
  std::vector<std::string> folders;
  std::string out;
  bool no_figures = false;
};

struct NamedTable {
  std::string name;
  Table table;
};

struct Report {
  std::vector<NamedTable> tables;
  std::vector<Figure> figures;
};

Report make_report(const std::vector<NoiseSweep>& sweeps, int jobs) {
  Report report;
  std::vector<NoiseLevelRow> levels;
  std::vector<AchievedNoiseRow> achieved;
  for (const NoiseSweep& sweep : sweeps) {
    for (NoiseLevelRow& row : noise_levels(sweep, jobs)) levels.push_back(std::move(row));
    for (AchievedNoiseRow& row : achieved_noise_rows(sweep)) achieved.push_back(std::move(row));
  }
  report.figures = noise_level_figures(levels);
  for (Figure& figure : achieved_noise_figures(achieved)) report.figures.push_back(std::move(figure));
  const auto add = [&](const char* name, Table table) {
    if (!table.rows.empty()) report.tables.push_back({name, std::move(table)});
  };
  add("claims", claim_table(sweeps));
  add("noise_levels", noise_level_table(levels));
  add("trends", trend_table(noise_trends(sweeps, jobs)));
  add("comparisons", comparison_table(compare_estimators(sweeps, jobs)));
  add("achieved_noise", achieved_noise_table(achieved));
  return report;
}

std::vector<Table> parts_of(const Table& table) {
  return split_rows(table, {"claim", "parameter", "source", "dataset", "sequence"});
}

/// Every table and figure on one page.
std::string page(const Report& report) {
  std::string text = "# Noise and errors\n\n";
  for (const Figure& figure : report.figures) {
    text += fmt::format("![{0}](figures/{1}.svg)\n\n{0}\n\n", figure.caption, figure.name);
  }
  for (const NamedTable& named : report.tables) text += to_markdown(named.table) + "\n";
  return text;
}

OutputFiles report_files(const Report& report, bool with_figures, int jobs) {
  OutputFiles files;
  for (const auto& [name, table] : report.tables) {
    files[name + ".md"] = to_markdown(table);
    files[name + ".csv"] = to_csv(table);
    files[name + ".json"] = rows_to_json(table).dump(2) + "\n";
  }
  if (!with_figures) return files;
  for (auto& [name, bytes] : draw(report.figures, jobs)) files["figures/" + name] = std::move(bytes);
  files["report.md"] = page(report);
  return files;
}

Json report_json(const Report& report) {
  Json json = Json::object();
  for (const auto& [name, table] : report.tables) json[name] = rows_to_json(table);
  return json;
}

void run_report(const ReportFlags& flags) {
  const Report report =
      make_report(read_noise_sweeps({flags.folders.begin(), flags.folders.end()}), flags.jobs);
  if (report.tables.empty())
    fail("no pair with truth in any of the {} folders: nothing to report", flags.folders.size());
  if (!flags.out.empty()) write_output_folder(flags.out, report_files(report, !flags.no_figures, flags.jobs));
  if (flags.json) {
    fmt::print("{}\n", report_json(report).dump(2));
  } else if (!flags.quiet) {
    for (const NamedTable& named : report.tables) {
      for (const Table& part : parts_of(named.table)) fmt::print("{}\n", to_text(part));
    }
    if (!flags.out.empty())
      fmt::print("Report: {}\n", (std::filesystem::path(flags.out) / "report.md").string());
    if (flags.out.empty() && !report.figures.empty()) {
      fmt::print("{} figures: give --out DIR to draw them\n", report.figures.size());
    }
  }
}

}  // namespace

void add_report_command(CLI::App& app) {
  const auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = app.add_subcommand(
      "report", "Errors by noise level, their growth, estimators compared, figures; from records");
  command->add_option("dir", flags->folders, "Folders of runs or sweeps")->required()->type_name("DIR");
  command->add_option("--out", flags->out, "Folder for report.md, tables (Markdown, CSV, JSON) and figures")
      ->type_name("DIR");
  command->add_flag("--no-figures", flags->no_figures, "Tables only");
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "Print nothing");
  command->add_flag("--json", flags->json, "Print as JSON: {\"noise_levels\": [..], \"trends\": [..], ..}");
  command->footer("Example:\n  sextant report results/runs/depth --out results/runs/depth/report");
  command->callback([flags] { run_report(*flags); });
}

}  // namespace sextant
