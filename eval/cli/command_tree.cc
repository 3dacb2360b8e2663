#include "sextant/eval/cli/command_tree.h"

#include <CLI/CLI.hpp>

#include <regex>
#include <set>

#include "sextant/datasets/synthetic/scenario.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/report/run_summary.h"

namespace sextant {
namespace {

/// Returns the words of "this|that" or "{this,that}"; empty if `text` is not a choice.
std::vector<std::string> choices_in(const std::string& text) {
  static const std::regex bars(R"([a-z0-9_]+(\|[a-z0-9_]+)+)"), braces(R"(\{[^{}]+\})");
  std::smatch found;
  if (std::regex_match(text, bars)) return split(text, '|');
  if (!std::regex_search(text, found, braces)) return {};
  return split(found.str().substr(1, found.length() - 2), ',');
}

/// Returns the keys of --set, each once: those of every estimator, of the noise and of every adapter.
std::vector<std::string> option_keys() {
  std::set<std::string> keys;
  for (const EstimatorEntry& estimator : all_estimators()) {
    for (const OptionHelp& option : run_options(estimator.name)) keys.insert(option.key);
  }
  for (const Adapter& adapter : adapters()) {
    for (const OptionHelp& option : adapter.options()) keys.insert("source." + option.key);
  }
  return {keys.begin(), keys.end()};
}

/// The scenes that come with the program, and "ADAPTER:" for each adapter that reads files.
std::vector<std::string> source_words() {
  std::vector<std::string> words;
  for (const Adapter& adapter : adapters()) {
    if (adapter.name != "synthetic") {
      words.push_back(adapter.name + ":");
      continue;
    }
    for (const std::string& scene : synthetic::scenario_names()) words.push_back("synthetic:" + scene);
  }
  return words;
}

template <typename Entries>
std::vector<std::string> names_in(const Entries& entries) {
  std::vector<std::string> names;
  for (const auto& entry : entries) names.emplace_back(entry.name);
  return names;
}

/// Returns the words that `flag` of `command` takes, for flags whose values the program keeps in a list of
/// its own.
std::vector<std::string> words_by_name(const std::string& command, const std::string& flag,
                                       const std::string& type) {
  if (flag == "--estimator") return names_in(all_estimators());
  if (flag == "--preset") return names_in(metric_presets());
  if (flag == "--procedure") return procedure_names();
  if (flag == "--set" || flag == "--options") return option_keys();
  if (type == "SOURCE") return source_words();
  if (type == "SCENARIO") return synthetic::scenario_names();
  if (command == "sextant evaluate ego" && flag.ends_with("format")) {
    std::vector<std::string> words = names_in(trajectory_formats());
    words.insert(words.begin(), "auto");
    return words;
  }
  return {};
}

/// Returns true for types whose values cannot be completed, such as numbers.
bool is_text(const std::string& type) {
  static const std::set<std::string> texts = {"N",   "K",    "NUMBER",    "INT",      "UINT",   "FLOAT",
                                              "I/N", "NAME", "DIRECTION", "DISTANCE", "I,J,..."};
  return texts.contains(type) || type.starts_with("JSON");
}

FlagHelp flag_help(const CLI::Option& option, const std::string& command) {
  FlagHelp help;
  const bool argument = option.get_positional();
  if (argument) {
    help.names = {option.get_name(true)};
  } else {
    for (const std::string& name : option.get_snames()) help.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) help.names.push_back("--" + name);
  }
  help.meaning = option.get_description();
  help.default_value = option.get_default_str();
  help.environment = option.get_envname();
  help.required = option.get_required();
  help.repeats =
      option.get_expected_max() > 1 || option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
  if (option.get_items_expected_max() == 0) return help;

  const std::string type = option.get_type_name();  // "N:INT in [1 - 1024]"
  const size_t colon = type.find(':');
  help.type = type.substr(0, colon);
  if (colon != std::string::npos) help.range = type.substr(colon + 1);
  help.words = words_by_name(command, help.names.back(), help.type);
  if (help.words.empty()) help.words = choices_in(help.type);
  if (help.words.empty()) help.words = choices_in(help.range);
  if (help.words.size() > 0 && help.range.starts_with('{')) help.range.clear();
  if (help.names.back() == "--set") {
    help.takes = Takes::keys;
  } else if (help.type == "SOURCE") {
    help.takes = Takes::source;
  } else if (!help.words.empty()) {
    help.takes = Takes::words;
  } else {
    help.takes = is_text(help.type) ? Takes::text : Takes::path;
  }
  return help;
}

CommandHelp command_help(const CLI::App& app, const std::string& parent) {
  CommandHelp help;
  help.name = parent.empty() ? app.get_name() : parent + " " + app.get_name();
  help.description = app.get_description();
  const CLI::App* above = app.get_parent();
  if (above == nullptr ||
      above->get_footer() != app.get_footer())  // CLI11 lets a command without a footer inherit its parent's
    help.footer = app.get_footer();
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? help.arguments : help.flags).push_back(flag_help(*option, help.name));
  }
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    help.commands.push_back(command_help(*command, help.name));
  return help;
}

void add_all(const CommandHelp& command, std::vector<const CommandHelp*>& all) {
  all.push_back(&command);
  for (const CommandHelp& below : command.commands) add_all(below, all);
}

}  // namespace

CommandHelp command_tree(const CLI::App& app) { return command_help(app, ""); }

std::vector<const CommandHelp*> all_commands(const CommandHelp& tree) {
  std::vector<const CommandHelp*> all;
  add_all(tree, all);
  return all;
}

}  // namespace sextant
