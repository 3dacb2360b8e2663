#include <CLI/CLI.hpp>

#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/version.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/errors_by_level.h"
#include "sextant/eval/report/estimator_comparisons.h"
#include "sextant/eval/report/figures/noise_figures.h"
#include "sextant/eval/report/html/report_folder.h"
#include "sextant/eval/report/trends.h"

namespace sextant {
namespace {

struct ReportFlags : CommonFlags {
  std::vector<std::string> folders;
  std::string out;
  bool no_figures = false;
};

std::string joined(const std::vector<std::string>& texts) {
  std::string text;
  for (const std::string& part : texts) text += (text.empty() ? "" : ", ") + part;
  return text;
}

const std::vector<std::string> split_keys = {"claim", "parameter", "source", "dataset", "sequence"};

/// Errors by noise level of all folders, as one document.
ReportDocument noise_document(const ReportFlags& flags) {
  const std::vector<NoiseSweep> sweeps = read_noise_sweeps({flags.folders.begin(), flags.folders.end()});
  std::vector<NoiseLevelRow> levels;
  std::vector<AchievedNoiseRow> achieved;
  for (const NoiseSweep& sweep : sweeps) {
    for (NoiseLevelRow& row : noise_levels(sweep, flags.jobs)) levels.push_back(std::move(row));
    for (AchievedNoiseRow& row : achieved_noise_rows(sweep)) achieved.push_back(std::move(row));
  }
  const std::vector<CheckedClaim> checked = check_claims(sweeps);
  ReportDocument document;
  document.title = "Noise and errors";
  document.abstract =
      "Errors of camera and objects by noise level, from the records of " + joined(flags.folders) +
      ". Intervals are 95 %, bootstrapped over seeds. Verdicts are on statements of the paper.";
  document.verdicts = claim_verdicts(checked, "#claims");
  const auto add = [&](const char* name, const char* heading, Table table, std::vector<Figure> figures = {}) {
    if (table.rows.empty()) return;
    document.sections.push_back({std::string(name) + "-section",
                                 heading,
                                 {},
                                 {{name, std::move(table), split_keys}},
                                 std::move(figures),
                                 {}});
  };
  add("claims", "Statements", claim_table(checked));
  add("noise_levels", "Errors by noise level", noise_level_table(levels), noise_level_figures(levels));
  add("trends", "Growth", trend_table(noise_trends(sweeps, flags.jobs)));
  add("comparisons", "Estimators compared", comparison_table(compare_estimators(sweeps, flags.jobs)));
  add("achieved_noise", "Achieved noise", achieved_noise_table(achieved), achieved_noise_figures(achieved));
  document.provenance = {{"records", joined(flags.folders)}, {"report by", "sextant " + version()}};
  document.citation = citation();
  return document;
}

std::vector<NamedTable> tables_of(const ReportDocument& document) {
  std::vector<NamedTable> tables;
  for (const ReportSection& section : document.sections)
    tables.insert(tables.end(), section.tables.begin(), section.tables.end());
  return tables;
}

void print(const ReportFlags& flags, const ReportDocument& document) {
  if (flags.json) {
    Json json = Json::object();
    for (const NamedTable& named : tables_of(document)) json[named.name] = rows_to_json(named.table);
    fmt::print("{}", json_text(json));
    return;
  }
  for (const NamedTable& named : tables_of(document)) {
    for (const Table& part : split_rows(named.table, named.split_by)) {
      fmt::print("{}\n", to_text(part));
    }
  }
  if (flags.out.empty()) fmt::print("Give --out DIR for figures and pages\n");
}

void run_report(const ReportFlags& flags) {
  const ReportDocument document = noise_document(flags);
  if (document.sections.empty())
    fail("no pair with truth in any of the {} folders: nothing to report", flags.folders.size());
  if (!flags.out.empty())
    write_output_folder(flags.out, report_folder(document, {!flags.no_figures, flags.jobs}));
  if (flags.json || !flags.quiet) print(flags, document);
  if (flags.json || flags.quiet || flags.out.empty() || flags.no_figures) return;
  fmt::print("Report: {}\n", (std::filesystem::path(flags.out) / "report.html").string());
}

}  // namespace

void add_report_command(CLI::App& app) {
  const auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = app.add_subcommand(
      "report", "Errors by noise level, their growth, estimators compared, figures; from records");
  command->add_option("dir", flags->folders, "Folders of runs or sweeps")->required()->type_name("DIR");
  command->add_option("--out", flags->out, "Folder for report.html, report.md, tables and figures")
      ->type_name("DIR");
  command->add_flag("--no-figures", flags->no_figures, "Tables only");
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "Print nothing");
  command->add_flag("--json", flags->json, "Print as JSON: {\"noise_levels\": [..], \"trends\": [..], ..}");
  command->footer("Example:\n  sextant report results/runs/depth --out results/runs/depth/report");
  command->callback([flags] { run_report(*flags); });
}

}  // namespace sextant
