#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/gate/comparison.h"
#include "sextant/eval/gate/history.h"
#include "sextant/eval/gate/side.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {
namespace {

struct CompareFlags : CommonFlags {
  std::string base;
  std::string fresh;
  std::string policy;
  std::string only;
  std::string out;
  std::vector<std::string> allowed;
  bool all = false;
  bool show_policy = false;
};

/// Returns the policy of the file `name`, or the default policy if no file is named.
Policy policy_in(const std::string& name) { return name.empty() ? Policy{} : read_policy(name); }

Policy policy_of(const CompareFlags& flags) {
  Policy policy = policy_in(flags.policy);
  Json tree = write_options(policy);
  for (const std::string& what : flags.allowed) tree["same"][what] = "note";
  read_options(tree, policy);
  if (flags.only == "accuracy") policy.speed.judge = false;
  if (flags.only == "speed") policy.accuracy.judge = false;
  return policy;
}

void print_policy(const Policy& policy, bool json) {
  if (json) {
    print_json(write_options(policy));
    return;
  }
  Table table;
  table.title = "Policy of sextant compare";
  table.columns = {Column::text("key"), Column::text("value"), Column::text("unit"), Column::text("meaning")};
  add_rows(describe_options(policy), table);
  fmt::print("{}", screen_text(table));
}

void print_part(const Table& table) {
  if (!table.rows.empty()) fmt::print("{}\n", screen_text(table));
}

void run_compare(const CompareFlags& flags) {
  const Policy policy = policy_of(flags);
  if (flags.show_policy) return print_policy(policy, flags.json);
  if (flags.base.empty() || flags.fresh.empty()) fail("expected two results: sextant compare BASE NEW");
  const auto lock = lock_folder(flags.out);
  const Comparison comparison = compare_paths(flags.base, flags.fresh, policy, flags.jobs);
  if (!flags.out.empty()) {
    OutputFiles files = comparison_files(comparison, policy, utc_timestamp());
    files["report.html"] = report_page(comparison_document(comparison, flags.out), flags.jobs);
    write_output_folder(flags.out, files);
  }
  if (flags.json) {
    print_json(comparison_json(comparison, policy));
  } else if (!flags.quiet) {
    if (const std::string largest = largest_change(comparison); !largest.empty())
      fmt::print("{}\n\n", largest);
    print_part(findings_table(comparison));
    print_part(family_table(comparison, !flags.all));
    print_part(status_table(comparison));
    print_part(accuracy_table(comparison, !flags.all));
    print_part(speed_table(comparison, !flags.all && comparison.speed.size() > 40));
    fmt::print("{}\n", headline(comparison));
  }
  if (comparison.verdict == GateVerdict::invalid) {
    const auto first = std::ranges::find(comparison.findings, true, &Mismatch::invalidates);
    const std::string sides = first->base.empty() && first->fresh.empty()
                                  ? ""
                                  : fmt::format(": BASE '{}', NEW '{}'", first->base, first->fresh);
    print_message("error", fmt::format("not comparable: {} {}{}", first->what, first->subject, sides));
  }
  throw Finished{exit_code(comparison.verdict)};
}

struct BaselineFlags : CommonFlags {
  std::string fresh;
  std::string baseline = "results/baseline";
  std::string policy;
  bool yes = false;
};

/// Prints the differences that accepting NEW would introduce, as `compare` does. Without a policy every
/// difference beyond rounding counts.
void show_changes(const BaselineFlags& flags) {
  Policy policy;
  policy.accuracy.other.minimum_effect = 0;
  if (!flags.policy.empty()) policy = read_policy(flags.policy);
  policy.speed.judge = false;
  const Comparison comparison = compare_paths(flags.baseline, flags.fresh, policy, flags.jobs);
  for (const Table& table : {findings_table(comparison), family_table(comparison, true),
                             status_table(comparison), accuracy_table(comparison, true)})
    print_part(table);
  fmt::print("{}\n", headline(comparison));
}

void run_update(const BaselineFlags& flags) {
  const OutputFiles files =
      baseline_files(flags.fresh);  // throws on bad results, which cannot become a baseline
  const bool exists = std::filesystem::exists(std::filesystem::path(flags.baseline) / "records.jsonl");
  if (!flags.quiet) {
    if (exists) {
      show_changes(flags);
    } else {
      fmt::print("{}: there is no baseline yet\n", flags.baseline);
    }
  }
  if (!flags.yes) {
    if (!flags.quiet) fmt::print("Nothing was written. Give --yes to make {} the baseline.\n", flags.fresh);
    return;
  }
  write_output_folder(flags.baseline, files);
  fmt::print("Baseline: {}\n", flags.baseline);
}

struct TrendFlags : CommonFlags {
  std::vector<std::string> folders;
  std::string out;
  std::string policy;
};

void run_trend(const TrendFlags& flags) {
  const History history = read_history({flags.folders.begin(), flags.folders.end()}, policy_in(flags.policy));
  const ReportDocument document = history_document(history);
  for (const std::string& warning : document.warnings) print_message("warning", warning);
  if (!flags.out.empty()) write_file(flags.out, report_page(document, flags.jobs));
  if (flags.json) {
    print_json(history_json(history));
    return;
  }
  if (flags.quiet) return;
  for (const NamedTable& named : document.sections.front().tables)
    fmt::print("{}\n", screen_text(named.table));
  for (const std::string& paragraph : document.sections.front().paragraphs) fmt::print("{}\n", paragraph);
  if (!flags.out.empty()) fmt::print("Page: {}\n", flags.out);
}

}  // namespace

void add_compare_command(CLI::App& app) {
  auto [command, flags] = add_command<CompareFlags>(
      app, "compare", "Compare the errors and times of NEW with those of BASE: has NEW regressed?",
      run_compare);
  add_value(command, "base", flags.base, "BASE", "Folder of a run or sweep, or JSON of Google Benchmark");
  add_value(command, "new", flags.fresh, "NEW", "The result to judge, in the same form as BASE");
  add_value(command, "--policy", flags.policy, "FILE", "What counts as a change; see --show-policy");
  command.add_flag("--show-policy", flags.show_policy, "Print every rule with its value and meaning");
  add_value(command, "--only", flags.only, "accuracy|speed", "Judge only errors, or only times")
      ->check(CLI::IsMember({"accuracy", "speed"}));
  add_value(
      command, "--allow", flags.allowed, "WHAT",
      "Report a difference of this kind without refusing to compare: cases, new_cases, data, configuration, "
      "definitions, machine")
      ->expected(1)
      ->take_all()
      ->check(CLI::IsMember({"cases", "new_cases", "data", "configuration", "definitions", "machine"}));
  add_value(command, "--out", flags.out, "DIR",
            "Folder for report.html, comparison.md, .json, junit.xml, bmf.json, github.json");
  add_jobs_flag(command, flags);
  command.add_flag("--all", flags.all, "Also print rows whose verdict is ok");
  command.add_flag("--quiet", flags.quiet, "Print nothing");
  command.add_flag("--json", flags.json, "Print as JSON");
  command.footer(
      "Exit codes: 0 ok or improved, 1 regressed, 2 invalid (bad input, or not comparable), 3 inconclusive.\n"
      "Example:\n  sextant compare results/baseline out --only accuracy");
}

void add_baseline_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("baseline", "The result that `compare` is given as BASE");
  command->require_subcommand(1);
  command->footer(
      "Examples:\n  sextant baseline update out --baseline baseline          (look)\n"
      "  sextant baseline update out --baseline baseline --yes");
  auto [update, flags] = add_command<BaselineFlags>(
      *command, "update", "Show what accepting NEW changes; with --yes accept it", run_update);
  add_value(update, "new", flags.fresh, "NEW", "Folder of a run or sweep")->required();
  add_value(update, "--baseline", flags.baseline, "DIR", "Folder of the baseline")->capture_default_str();
  add_value(update, "--policy", flags.policy, "FILE", "What is shown as a change; see `sextant compare`");
  update.add_flag("--yes", flags.yes, "Make NEW the baseline");
  add_jobs_flag(update, flags);
  update.add_flag("--quiet", flags.quiet, "Do not show the changes");
  update.footer(
      "Examples:\n  sextant baseline update out          (look)\n  sextant baseline update out --yes");
}

void add_trend_command(CLI::App& app) {
  auto [command, flags] = add_command<TrendFlags>(
      app, "trend", "Past results as series over time, with changes of level", run_trend);
  add_value(command, "dir", flags.folders, "DIR",
            "Results, oldest first, or folders of results, which are taken in order of their names")
      ->required();
  add_value(command, "--out", flags.out, "FILE.html", "Self-contained page");
  add_value(command, "--policy", flags.policy, "FILE", "Smallest step that counts; see `sextant compare`");
  add_jobs_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "Print nothing");
  command.add_flag("--json", flags.json, "Print the series as JSON");
  command.footer("Example:\n  sextant trend past-runs --out trend.html");
}

}  // namespace sextant
