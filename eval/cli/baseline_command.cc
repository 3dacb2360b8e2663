#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/gate/comparison.h"
#include "sextant/eval/gate/side.h"

namespace sextant {
namespace {

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
                             status_table(comparison), accuracy_table(comparison, true)}) {
    if (!table.rows.empty()) fmt::print("{}\n", to_text(table));
  }
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

}  // namespace

void add_baseline_command(CLI::App& app) {
  const auto flags = std::make_shared<BaselineFlags>();
  CLI::App* command = app.add_subcommand("baseline", "The result that `compare` is given as BASE");
  command->require_subcommand(1);
  command->footer(
      "Examples:\n  sextant baseline update out --baseline baseline          (look)\n"
      "  sextant baseline update out --baseline baseline --yes");
  CLI::App* update =
      command->add_subcommand("update", "Show what accepting NEW changes; with --yes accept it");
  add_value(*update, "new", flags->fresh, "NEW", "Folder of a run or sweep")->required();
  add_value(*update, "--baseline", flags->baseline, "DIR", "Folder of the baseline")->capture_default_str();
  add_value(*update, "--policy", flags->policy, "FILE", "What is shown as a change; see `sextant compare`");
  update->add_flag("--yes", flags->yes, "Make NEW the baseline");
  add_jobs_flag(*update, *flags);
  update->add_flag("--quiet", flags->quiet, "Do not show the changes");
  update->footer(
      "Examples:\n  sextant baseline update out          (look)\n  sextant baseline update out --yes");
  update->callback([flags] { run_update(*flags); });
}

}  // namespace sextant
