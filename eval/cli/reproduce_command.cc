#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/report/paper/renderings.h"
#include "sextant/eval/workflow/report_output.h"

namespace sextant {
namespace {

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
    fmt::print("{}", json_text(Json{{"report", made.report.string()}, {"verdicts", verdicts}}));
    return;
  }
  if (!flags.quiet) {
    fmt::print("{}\n\n", wrapped(document.abstract, 100));
    for (const VerdictLine& line : document.verdicts) fmt::print("{:<18} {}\n", line.verdict, line.subject);
    for (const PaperLayout& table : made.tables) fmt::print("\n{}", to_text(table, false));
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

void add_reproduce_command(CLI::App& app) {
  const auto flags = std::make_shared<ReproduceFlags>();
  CLI::App* command =
      app.add_subcommand("reproduce", "Every table, figure and claim of the paper, with a verdict");
  add_value(*command, "--out", flags->out, "DIR",
            "Folder for records and report; an unfinished one is resumed")
      ->required();
  command->add_flag("--report-only", flags->report_only,
                    "Run nothing; write the report of the records that --out holds");
  add_cache_flag(*command, flags->cache);
  add_data_flag(*command, *flags);
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress; only where the report is");
  command->add_flag("--json", flags->json, "Print the verdicts as JSON");
  command->footer(
      "Without data the embedded scenarios are measured; docs/reproduction.md lists the data of every "
      "experiment.\n"
      "Ctrl-C or a crash loses nothing: give the same command again.\n"
      "Example:\n  sextant reproduce --data $SEXTANT_DATA --out results/runs/reproduce");
  command->callback([flags] { reproduce_with_flags(*flags); });
}

}  // namespace sextant
