
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/report/paper/paper_layout.h"
#include "sextant/eval/workflow/workflow.h"

namespace sextant {
namespace {

struct ReportFlags : CommonFlags {
  std::vector<std::string> folders;
  std::string out, columns = "first";
  bool no_figures = false;
};

std::vector<const NamedTable*> tables_of(const ReportDocument& document) {
  std::vector<const NamedTable*> tables;
  for (const ReportSection& section : document.sections)
    for (const NamedTable& table : section.tables) tables.push_back(&table);
  return tables;
}

void print(const ReportFlags& flags, const ReportDocument& document) {
  if (flags.json) {
    Json json = Json::object();
    for (const NamedTable* named : tables_of(document)) json[named->name] = rows_to_json(named->table);
    print_json(json);
    return;
  }
  for (const NamedTable* named : tables_of(document)) {
    std::vector<std::string> keys = named->first;
    std::erase(keys, "records");
    const bool all = flags.columns == "all" || keys.empty();
    if (flags.columns == "first" && named->only_on_request) continue;
    for_each_part(named->table, named->split_by, [&](const Table& part) {
      fmt::print("{}\n", screen_text(all ? part : with_columns(part, keys)));
    });
  }
  if (flags.columns == "first") fmt::print("More: --columns all\n");
  if (flags.out.empty()) fmt::print("Give --out DIR for figures and pages\n");
}

void run_report(const ReportFlags& flags) {
  const ReportDocument document = report_sweeps({flags.folders.begin(), flags.folders.end()}, flags.out,
                                                {!flags.no_figures, flags.jobs, flags.quiet || flags.json});
  for (const std::string& warning : document.warnings) print_message("warning", warning);
  if (flags.json || !flags.quiet) print(flags, document);
  if (flags.json || flags.quiet || flags.out.empty() || flags.no_figures) return;
  fmt::print("Report: {}\n", (std::filesystem::path(flags.out) / "report.html").string());
}

struct ReproduceFlags : CommonFlags {
  std::string out;
  std::string cache;
  bool report_only = false;
};

void print_outcome(const ReproduceFlags& flags, const Reproduction& made) {
  const ReportDocument& document = made.document;
  if (flags.json) {
    Json verdicts = Json::array();
    for (const VerdictLine& line : document.verdicts) {
      verdicts.push_back({{"subject", line.subject}, {"verdict", line.verdict}, {"evidence", line.evidence}});
    }
    print_json(Json{{"report", made.report.string()}, {"verdicts", verdicts}});
    return;
  }
  if (!flags.quiet) {
    constexpr size_t columns = 100, columns_of_verdict = 19;
    fmt::print("{}\n\n", wrapped(document.abstract, columns));
    for (const VerdictLine& line : document.verdicts) {
      fmt::print("{}\n", wrapped(fmt::format("{:<18} {}", line.verdict, line.subject), columns,
                                 std::string(columns_of_verdict, ' ')));
    }
    fmt::print("\n");
    for (const PaperLayout& table : made.tables) fmt::print("{}", to_text(table, false));
    fmt::print("{}", text_legend());
  }
  fmt::print("Report: {}\nVerdicts: {}\n", made.report.string(), count_verdicts(document.verdicts));
}

void reproduce_with_flags(const ReproduceFlags& flags) {
  ReproduceConfig config;
  config.data_root = flags.data_root;
  config.out = flags.out;
  config.parts = reproduction_parts(flags.data_root);
  config.cache = pack_cache(flags.cache);
  config.jobs = flags.jobs;
  config.quiet = flags.quiet;
  print_outcome(flags, reproduce(config, flags.report_only));
}

}  // namespace

void add_report_command(CLI::App& app) {
  auto [command, flags] = add_command<ReportFlags>(
      app, "report", "Errors by noise level, their growth, estimators compared, figures; from records",
      run_report);
  add_value(command, "dir", flags.folders, "DIR", "Folders of runs or sweeps")->required();
  add_value(command, "--out", flags.out, "DIR", "Folder for report.html, report.md, tables and figures");
  command.add_flag("--no-figures", flags.no_figures, "Tables only");
  add_jobs_flag(command, flags);
  add_value(command, "--columns", flags.columns, "first|all",
            "Columns that fit a terminal, or all columns and tables")
      ->check(CLI::IsMember({"first", "all"}));
  command.add_flag("--quiet", flags.quiet, "Print nothing");
  command.add_flag("--json", flags.json, "Print as JSON: {\"noise_levels\": [..], \"trends\": [..], ..}");
  command.footer("Example:\n  sextant report results/runs/depth --out results/runs/depth/report");
}

void add_reproduce_command(CLI::App& app) {
  auto [command, flags] = add_command<ReproduceFlags>(
      app, "reproduce", "Every table, figure and claim of the paper, with a verdict", reproduce_with_flags);
  add_value(command, "--out", flags.out, "DIR", "Folder for records and report; an unfinished one is resumed")
      ->required();
  command.add_flag("--report-only", flags.report_only,
                   "Run nothing; write the report of the records that --out holds");
  add_cache_flag(command, flags.cache);
  add_data_flag(command, flags);
  add_jobs_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress; only where the report is");
  command.add_flag("--json", flags.json, "Print the verdicts as JSON");
  command.footer(
      "Without data the embedded scenarios are measured; docs/reproduction.md lists the data of every "
      "experiment.\n"
      "Ctrl-C or a crash loses nothing: give the same command again.\n"
      "Example:\n  sextant reproduce --data $SEXTANT_DATA --out results/runs/reproduce");
}

}  // namespace sextant
