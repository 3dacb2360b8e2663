#pragma once

// Subcommands of `sextant`. How to add one:
//   1. write eval/cli/<name>_command.cc with a function add_<name>_command(CLI::App&) that declares its flags
//      on a new subcommand, an example in its footer, and what it does as a callback; commands about the same
//      subject share a file (compare_command.cc: compare, baseline, trend);
//   2. declare it here and add one line to the table in program.cc.
// Commands contain no logic of their own: they read flags, call the layers below and print.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace sextant {

struct OptionHelp;
struct Table;

/// Exit codes of every command.
enum ExitCode { exit_ok = 0, exit_bad_input = 2, exit_internal = 70, exit_interrupted = 130 };

/// Adds one subcommand to the program.
using AddCommand = void (*)(CLI::App&);

/// Runs the program: parses the arguments, runs one command, and turns exceptions into an exit code and one
/// line on stderr. Returns the exit code.
int program(int argc, const char* const* argv, std::span<const AddCommand> commands);
/// Overload with every command of the program.
int program(int argc, const char* const* argv);

/// Prints "sextant: KIND: TEXT" on stderr, where KIND is error, warning or note. The output is one line of
/// bounded length, whatever TEXT contains.
void print_message(std::string_view kind, const std::string& text);

/// Returns the words with which a user calls a command, e.g. "sextant evaluate ego".
std::string words_of(const CLI::App& command);

/// Adds a row per option: key, default, unit and meaning.
void add_rows(const std::vector<OptionHelp>& options, Table& table);

void add_run_command(CLI::App& app);
void add_rescore_command(CLI::App& app);
void add_sweep_command(CLI::App& app);
void add_merge_command(CLI::App& app);
void add_benchmark_command(CLI::App& app);
void add_report_command(CLI::App& app);
void add_reproduce_command(CLI::App& app);
void add_evaluate_command(CLI::App& app);
void add_cache_command(CLI::App& app);
void add_data_command(CLI::App& app);
void add_options_command(CLI::App& app);
void add_overlay_command(CLI::App& app);
void add_view_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_completion_command(CLI::App& app);
void add_man_command(CLI::App& app);
void add_help_command(CLI::App& app);
void add_explain_command(CLI::App& app);
void add_noise_command(CLI::App& app);
void add_compare_command(CLI::App& app);
void add_trend_command(CLI::App& app);
void add_baseline_command(CLI::App& app);

/// Thrown to end the program with an exit code that is a result, after everything has been printed:
/// `compare` also exits with 1 and 3.
struct Finished {
  int code = 0;
};

}  // namespace sextant
