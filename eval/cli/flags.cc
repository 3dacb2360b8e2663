#include "sextant/eval/cli/flags.h"

#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/base/machine.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/report/table.h"

namespace sextant {

std::string screen_text(const Table& table) {
  winsize size{};
  const bool is_terminal = isatty(STDOUT_FILENO) == 1 && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0;
  return to_text(table, is_terminal ? size.ws_col : 0);
}

CLI::Option* add_choice(CLI::App& command, const std::string& flag, const std::string& help,
                        const std::vector<std::string_view>& names, std::string_view preset,
                        const std::function<void(const std::string&)>& take) {
  return command.add_option_function<std::string>(flag, take, help)
      ->type_name(fmt::format("{}", fmt::join(names, "|")))
      ->default_str(std::string(preset));
}

void add_source_argument(CLI::App& command, std::string& source) {
  add_value(command, "source", source, "SOURCE", "adapter:path[#sequence][@first-last]")->required();
}

void add_cache_flag(CLI::App& command, std::string& folder) {
  add_value(command, "--cache", folder, "DIR",
            "Folder of correspondence caches, writable by this user only (default: $SEXTANT_CACHE or "
            "~/.cache/sextant)");
}

void add_data_flag(CLI::App& command, CommonFlags& flags) {
  add_value(command, "--data", flags.data_root, "ROOT", "Folder in which relative source paths are looked up")
      ->envname("SEXTANT_DATA");
}

void add_option_flags(CLI::App& command, CommonFlags& flags) {
  add_value(command, "--options", flags.options, "JSON|@FILE",
            "Options as JSON, or @FILE; see `sextant options`");
  add_value(command, "--set", flags.sets, "KEY=VALUE",
            "One option, e.g. pipeline.max_object_distance_m=30; repeatable")
      ->expected(1)
      ->take_all();
}

void add_jobs_flag(CLI::App& command, CommonFlags& flags) {
  flags.jobs = available_cores();
  add_value(command, "--jobs", flags.jobs, "N", "Number of threads; results do not depend on it")
      ->default_str("number of cores")
      ->check(CLI::Range(1, 1024));
}

void add_case_flags(CLI::App& command, CaseChoice& choice) {
  add_value(command, "--source", choice.source, "SOURCE", "Which source of the folder; default: its first");
  add_value(command, "--estimator", choice.estimator, "NAME",
            "Which estimator, by its label; default: the first");
  add_value(command, "--level", choice.level, "NUMBER", "Which noise level; default: the first");
  add_value(command, "--noise", choice.noise, "NAME",
            "Which kind of noise, by its name in records, where a level has several");
  add_value(command, "--seed", choice.seed, "N", "Which seed; default: the first");
}

SourceSpec source_of(const std::string& text, const CommonFlags& flags) {
  SourceSpec spec = find_source(text, flags.data_root);
  const Json options = options_tree(flags.options, flags.sets);
  for (const auto& item : options.items()) {
    if (item.key() != "source")
      fail("unknown option key '{}': expected keys that begin with source.", item.key());
  }
  spec.add_options(options.value("source", Json::object()));
  return spec;
}

std::string estimator_list() {
  std::string text;
  for (const EstimatorEntry& entry : all_estimators())
    text += fmt::format("  {:<20} {}\n", entry.name, entry.description);
  return text;
}

void warn_of_problems(std::span<const std::string> problems) {
  constexpr size_t most = 20;
  for (const std::string& problem : problems.first(std::min(most, problems.size())))
    print_message("warning", problem);
  if (problems.size() > most) {
    print_message("warning", fmt::format("{} more warnings are not printed: see also log.txt of each case",
                                         problems.size() - most));
  }
}

}  // namespace sextant
