#pragma once

// Subcommands of `sextant`. How to add one:
//   1. write eval/cli/<name>_command.cc with a function add_<name>_command(CLI::App&) that declares its flags
//      on a new subcommand, an example in its footer, and what it does as a callback;
//   2. declare it here and add one line to the table in all_commands.cc.
// Commands hold no logic of their own: they read flags, call the layers below and print.

#include <nlohmann/json.hpp>

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/experiment/pack_cache.h"

namespace CLI {
class App;
class Option;
}

namespace sextant {

struct RunConfig;
struct RunResult;
struct SweepConfig;

/// Exit codes of every command.
enum ExitCode { exit_ok = 0, exit_bad_input = 2, exit_internal = 70, exit_interrupted = 130 };

/// The program: parses, runs one command, turns exceptions into exit codes and one line on stderr.
using AddCommand = void (*)(CLI::App&);
int program(int argc, const char* const* argv, std::span<const AddCommand> commands);
/// With every command.
int program(int argc, const char* const* argv);

/// "sextant: KIND: TEXT" on stderr, KIND being error, warning or note: one line of bounded length, whatever TEXT holds.
void tell(std::string_view kind, const std::string& text);

/// The words with which a user calls a command, e.g. "sextant evaluate ego".
std::string words_of(const CLI::App& command);

void add_run_command(CLI::App& app);
void add_rescore_command(CLI::App& app);
void add_sweep_command(CLI::App& app);
void add_merge_command(CLI::App& app);
void add_report_command(CLI::App& app);
void add_reproduce_command(CLI::App& app);
void add_evaluate_command(CLI::App& app);
void add_cache_command(CLI::App& app);
void add_data_command(CLI::App& app);
void add_data_check_command(CLI::App& data);
void add_data_make_command(CLI::App& data);
void add_data_pack_command(CLI::App& data);
void add_data_strip_command(CLI::App& data);
void add_options_command(CLI::App& app);
void add_overlay_command(CLI::App& app);
void add_view_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_completion_command(CLI::App& app);
void add_man_command(CLI::App& app);
void add_help_command(CLI::App& app);
void add_explain_command(CLI::App& app);
void add_noise_command(CLI::App& app);
void add_evaluate_ego_command(CLI::App& evaluate);
void add_evaluate_objects_command(CLI::App& evaluate);
void add_evaluate_flow_command(CLI::App& evaluate);
void add_evaluate_depth_command(CLI::App& evaluate);
void add_compare_command(CLI::App& app);
void add_trend_command(CLI::App& app);
void add_baseline_command(CLI::App& app);

/// Ends the program with an exit code that is a result, after everything has been printed: `compare` also has 1 and 3.
struct Finished {
  int code = 0;
};

// ---- shared by commands

/// Flags that several commands have.
struct CommonFlags {
  std::string data_root;          ///< --data or SEXTANT_DATA
  std::string options;            ///< --options
  std::vector<std::string> sets;  ///< --set key=value
  int jobs = 0;
  bool quiet = false;
  bool json = false;
};

/// A flag whose values are the names of an enumeration; another one is an Error that tells the nearest name.
template <Named E>
CLI::Option* add_choice(CLI::App& command, const std::string& flag, E& value, const std::string& help) {
  const auto names = names_of(E{});
  const std::string kind = flag.substr(flag.find_first_not_of('-'));
  return add_choice(command, flag, help, {names.begin(), names.end()}, to_string(value),
                    [&value, kind](const std::string& text) { value = from_name<E>(text, kind); });
}
CLI::Option* add_choice(CLI::App& command, const std::string& flag, const std::string& help,
                        const std::vector<std::string_view>& names, std::string_view preset,
                        const std::function<void(const std::string&)>& take);

void add_source_argument(CLI::App& command, std::string& source);
void add_data_flag(CLI::App& command, CommonFlags& flags);
void add_cache_flag(CLI::App& command, std::string& folder);
void add_option_flags(CLI::App& command, CommonFlags& flags);
void add_jobs_flag(CLI::App& command, CommonFlags& flags);

/// The packs in --cache, or where they are by default.
PackCache cache_of(const std::string& folder);

/// SOURCE below --data, with the options below "source" of the tree; others are an Error.
SourceSpec source_of(const std::string& text, const CommonFlags& flags);

/// The options tree: `options` is JSON or @FILE, then each "dotted.key=value" of `sets` on top of it.
Json options_tree(const std::string& options, std::span<const std::string> sets);

/// The first few on stderr, as warnings, and how many more there are.
void warn_of_problems(std::span<const std::string> problems);

/// What becomes of the results of a run.
struct RunOutput {
  std::string preset = "paper";
  std::string out;
  std::string columns = "first";
  std::string data_root;  ///< --data; empty where the environment says it
  bool force = false, quiet = false, json = false;

  void take(const CommonFlags& flags);
};
void add_run_output_flags(CLI::App& command, RunOutput& output);
/// Runs and writes the folder `out`; goes on after the sources that an earlier run has done.
RunResult run_into_folder(const RunConfig& config, const RunOutput& output);
/// The same, and prints the summary.
void run_and_write(const RunConfig& config, const RunOutput& output);
/// Sweeps, prints what was done.
void sweep_and_print(SweepConfig config, bool json);

/// What --set and --options take with an estimator, apart from the data set's adapter (`source.*`).
std::vector<OptionHelp> run_options(const std::string& estimator);
/// Keys of a plan that are options.
std::vector<OptionHelp> plan_options();

/// "NAME  description" lines of all estimators, for help texts.
std::string estimator_list();

}  // namespace sextant
