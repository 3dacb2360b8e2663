#include <memory>

#include "sextant/base/files.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/gate/history.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {
namespace {

struct TrendFlags : CommonFlags {
  std::vector<std::string> folders;
  std::string out;
  std::string policy;
};

void run_trend(const TrendFlags& flags) {
  Policy policy;
  if (!flags.policy.empty()) policy = read_policy(flags.policy);
  const History history = read_history({flags.folders.begin(), flags.folders.end()}, policy);
  const ReportDocument document = history_document(history);
  if (!flags.out.empty()) {
    std::vector<Figure> figures;
    for (const ReportSection& section : document.sections)
      figures.insert(figures.end(), section.figures.begin(), section.figures.end());
    write_file(flags.out, to_html(document, draw(figures, flags.jobs)));
  }
  if (flags.json) {
    fmt::print("{}", json_text(history_json(history)));
    return;
  }
  if (flags.quiet) return;
  for (const NamedTable& named : document.sections.front().tables) fmt::print("{}\n", to_text(named.table));
  for (const std::string& paragraph : document.sections.front().paragraphs) fmt::print("{}\n", paragraph);
  if (!flags.out.empty()) fmt::print("Page: {}\n", flags.out);
}

}  // namespace

void add_trend_command(CLI::App& app) {
  const auto flags = std::make_shared<TrendFlags>();
  CLI::App* command = app.add_subcommand("trend", "Past results as series over time, with changes of level");
  add_value(*command, "dir", flags->folders, "DIR",
            "Results, oldest first, or folders of results, which are taken in order of their names")
      ->required();
  add_value(*command, "--out", flags->out, "FILE.html", "Self-contained page");
  add_value(*command, "--policy", flags->policy, "FILE", "Smallest step that counts; see `sextant compare`");
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "Print nothing");
  command->add_flag("--json", flags->json, "Print the series as JSON");
  command->footer("Example:\n  sextant trend past-runs --out trend.html");
  command->callback([flags] { run_trend(*flags); });
}

}  // namespace sextant
