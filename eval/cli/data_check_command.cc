#include <CLI/CLI.hpp>

#include <memory>

#include "sextant/eval/check/check_source.h"
#include "sextant/eval/cli/command.h"

namespace sextant {
namespace {

void check(const std::string& source, const CommonFlags& flags, bool quick) {
  const std::unique_ptr<Sequence> sequence = open_source(source_of(source, flags));
  const std::vector<SourceCheck> checks =
      check_source(*sequence, {.jobs = flags.jobs, .quiet = flags.quiet, .quick = quick});
  if (flags.json) {
    fmt::print("{}", json_text(check_json(source, checks)));
  } else if (!flags.quiet) {
    fmt::print("{}", check_page(source, sequence->info(), checks));
  }
  std::fflush(stdout);
  refuse_failed(source, checks);
}

}  // namespace

void add_data_check_command(CLI::App& data) {
  const auto flags = std::make_shared<CommonFlags>();
  const auto source = std::make_shared<std::string>();
  const auto quick = std::make_shared<bool>(false);
  CLI::App* command =
      data.add_subcommand("check", "Decode everything a source has; check that its parts fit together");
  add_source_argument(*command, *source);
  add_data_flag(*command, *flags);
  add_option_flags(*command, *flags);
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress and no table: only the exit code and errors");
  command->add_flag("--quick", *quick, "Decode only the 24 frames that the convention checks look at");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->footer(
      "PASS, SUSPECT or FAIL per line with the likely cause, note for what cannot be checked; "
      "exit code 2 when\n"
      "one fails. docs/data-check.md explains every line.\n"
      "Example:\n  sextant data check vdo:kitti_03_demo@0-19");
  command->callback([flags, source, quick] { check(*source, *flags, *quick); });
}

}  // namespace sextant
