#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include <CLI/CLI.hpp>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/external/external_estimator.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {
namespace {

constexpr const char* interrupted_text =
    "interrupted; run (with --out), sweep, benchmark and reproduce continue when the same command is given "
    "again";

int report(const std::string& message, int code) {
  print_message("error", message.substr(0, message.find_last_not_of(" \n") + 1));
  return code;
}

/// Flushes standard output. A result that could not be written completely turns success into an error
/// message and exit code 2.
int after_output(int code) {
  std::cout.flush();
  const bool failed = std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout;
  if (!failed || code == exit_interrupted || code == exit_internal) return code;
  return report(fmt::format("standard output: cannot write all of it: {}", std::strerror(errno)),
                exit_bad_input);
}

/// After more than 10 s of work, prints the time that each stage took.
void print_times(std::chrono::steady_clock::time_point start) {
  constexpr double long_s = 10;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::string parts = time_summary();
  if (seconds < long_s || parts.empty()) return;
  std::fflush(stdout);  // so that the line does not interrupt a table if both are written into one file
  print_error(fmt::format("Time: {:.1f} s; of it {}\n", seconds, parts));
}

/// Names of files end up in JSON and pages, which are UTF-8: a name that is not is refused before anything
/// is computed. So is `--flag=` without a value, for which CLI11 would take the next argument.
void check_texts(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view text = argv[i];
    if (text.starts_with("--") && text.find('=') == text.size() - 1)
      fail("{}: expected a value after '=', got none", text.substr(0, text.size() - 1));
    if (!is_utf8(argv[i]))
      fail("argument {} is not UTF-8: '{}': rename the file or folder", i, one_line(argv[i]));
  }
  const char* data = std::getenv("SEXTANT_DATA");
  if (data != nullptr && !is_utf8(data))
    fail("SEXTANT_DATA is not UTF-8: '{}': rename the folder", one_line(data));
}

/// Refuses empty names: `--out ''` would mean the working folder.
void refuse_empty_names(CLI::App& command) {
  for (const char* name : {"--out", "--cache", "--save-zip", "--save-tum", "--policy", "--data"}) {
    CLI::Option* option = command.get_option_no_throw(name);
    if (option == nullptr) continue;
    option->check(CLI::Validator(
        [](const std::string& text) {
          return text.empty() ? "expected a file or folder, got ''" : std::string();
        },
        ""));
  }
  for (CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; }))
    refuse_empty_names(*sub);
}

/// Containers are sized in proportion to what files declare, so the file opened last is the most likely
/// cause and is named.
int report_no_memory() {
  const std::string file = last_opened_file();
  return report(
      fmt::format("{}{}not enough memory: give a smaller input or fewer --jobs, or allow more (`ulimit -v`)",
                  file, file.empty() ? "" : ": "),
      exit_bad_input);
}

int report_no_thread() {
  return report("cannot start a thread: give fewer --jobs, or allow more threads and processes (`ulimit -u`)",
                exit_bad_input);
}

std::terminate_handler previous_terminate = nullptr;

/// Terminate handler: TBB, which the ray caster uses, throws an exception that cannot be caught when it
/// cannot start a thread.
[[noreturn]] void end_without_thread() {
  try {
    if (std::current_exception()) throw;
  } catch (const std::bad_alloc&) {
    std::_Exit(report_no_memory());
  } catch (const std::exception& error) {
    if (std::string_view(error.what()).find("pthread_create") != std::string_view::npos)
      std::_Exit(report_no_thread());
  } catch (...) {  // the previous handler reports it
  }
  previous_terminate();
  std::abort();
}

/// Returns the innermost command on the command line.
const CLI::App& innermost(const CLI::App& app) {
  const auto given = app.get_subcommands();
  return given.empty() ? app : innermost(*given.front());
}

/// Formats the message for a wrong command line, with the nearest valid name for an unknown one.
std::string usage_message(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = innermost(app);
  const std::vector<std::string> rest = app.remaining(/*recurse=*/true);
  const auto flag =
      std::find_if(rest.begin(), rest.end(), [](const auto& word) { return word.starts_with('-'); });
  if (flag != rest.end()) {
    const std::string name = flag->substr(0, flag->find('='));
    std::vector<std::string> flags;
    for (const CLI::Option* option : command.get_options()) {
      for (const std::string& known : option->get_lnames()) flags.push_back("--" + known);
    }
    return fmt::format("unknown flag '{}': {}", name, suggest(name, flags));
  }
  // `sweep` runs a plan itself and also has subcommands; other commands with subcommands need one.
  std::vector<std::string> names;
  for (const CLI::App* below : command.get_subcommands([](const CLI::App*) { return true; })) {
    if (command.get_require_subcommand_min() > 0) names.push_back(below->get_name());
  }
  if (!rest.empty() && !names.empty()) {
    return fmt::format("unknown command '{}': {}", rest.front(), suggest(rest.front(), names));
  }
  if (!rest.empty()) return fmt::format("unexpected argument '{}'", rest.front());
  if (!names.empty()) return fmt::format("a command is missing: {}", suggest("", names));
  return fmt::format("{}; see `{} --help`", error.what(), words_of(command));
}

int run(int argc, const char* const* argv, std::span<const AddCommand> commands) {
  CLI::App app(
      "Evaluation and benchmarking of multi-body visual odometry: "
      "the motion of the camera and of every moving object.",
      "sextant");
  app.footer(
      "Examples:\n  sextant run synthetic:s18 --out out\n  sextant help evaluate ego\n"
      "Exit codes: 0 done, 2 bad input or usage, 130 interrupted, 70 internal error.");
  app.set_version_flag("--version", fmt::format("sextant {} ({})", version(), git_commit()));
  app.require_subcommand(1);
  for (const AddCommand add : commands) add(app);
  refuse_empty_names(app);

  try {
    check_texts(argc, argv);
    const auto start = std::chrono::steady_clock::now();
    if (argc <= 1) {  // `sextant` without arguments
      fmt::print("{}", app.help());
      return exit_ok;
    }
    app.parse(argc, argv);
    print_times(start);
    return exit_ok;
  } catch (const Finished& finished) {
    return finished.code;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return report(usage_message(app, error), exit_bad_input);
  } catch (const Error& error) {
    return report(error.what(), exit_bad_input);
  } catch (const Interrupted&) {
    return report(interrupted_text, exit_interrupted);
  } catch (const std::bad_alloc&) {
    return report_no_memory();
  } catch (const std::length_error&) {  // a container was asked for more elements than it can hold
    return report_no_memory();
  } catch (
      const std::filesystem::filesystem_error& error) {  // a folder of the user: loop of links, no permission
    const std::string path = error.path1().empty() ? std::string("a file") : error.path1().string();
    return report(fmt::format("{}: {}: expected a file or folder that this user may read and write", path,
                              error.code().message()),
                  exit_bad_input);
  } catch (const std::system_error& error) {
    if (std::ferror(stdout) != 0) return exit_bad_input;  // fmt::print() throws; after_output() says why
    if (error.code() == std::errc::resource_unavailable_try_again) return report_no_thread();
    return report(fmt::format("internal: {}", error.what()), exit_internal);
  } catch (const std::exception& error) {
    return report(fmt::format("internal: {}", error.what()), exit_internal);
  }
}

constexpr auto command_table = std::to_array<AddCommand>({
    add_data_command,    add_run_command,       add_rescore_command,  add_sweep_command,
    add_merge_command,   add_benchmark_command, add_report_command,   add_reproduce_command,
    add_compare_command, add_trend_command,     add_baseline_command, add_evaluate_command,
    add_overlay_command, add_noise_command,     add_view_command,     add_export_command,
    add_explain_command, add_cache_command,     add_options_command,  add_completion_command,
    add_man_command,     add_help_command,
});

}  // namespace

std::string words_of(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent == nullptr ? command.get_name() : words_of(*parent) + " " + command.get_name();
}

void print_message(std::string_view kind, const std::string& text) {
  constexpr size_t longest =
      4000;  // the message may quote a file; its first and last characters name the file and the remedy
  std::string line = one_line(text);
  if (line.size() > longest) {
    line = fmt::format("{} ... {}", one_line(line.substr(0, longest / 2)),
                       one_line(line.substr(line.size() - longest / 2)));
  }
  print_error(fmt::format("sextant: {}: {}\n", kind, line));
}

// Called before the initialisers of the shared libraries, because some of these open files.
[[gnu::section(".preinit_array"), gnu::used]] void (*const open_streams_first)() = open_closed_streams;

int program(int argc, const char* const* argv, std::span<const AddCommand> commands) {
  install_interrupt_handler(fmt::format("sextant: error: {}\n", interrupted_text), exit_interrupted);
  std::signal(SIGXFSZ,
              SIG_IGN);  // writing a file beyond `ulimit -f` becomes an error of write(), like a full disk
  previous_terminate = std::set_terminate(end_without_thread);
  return after_output(run(argc, argv, commands));
}

int program(int argc, const char* const* argv) {
  add_external_estimators();
  return program(argc, argv, command_table);
}

}  // namespace sextant
