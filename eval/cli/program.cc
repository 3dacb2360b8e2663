#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "sextant/base/error.h"
#include "sextant/eval/cli/gate.h"
#include "sextant/eval/experiment/interrupt.h"
#include "sextant/eval/experiment/version.h"

namespace sextant {
namespace {

int report(const std::string& message, int code) {
  std::string line = message.substr(0, message.find_last_not_of(" \n") + 1);
  std::replace(line.begin(), line.end(), '\n', ' ');
  fmt::print(stderr, "sextant: error: {}\n", line);
  return code;
}

int report_no_thread() {
  return report("cannot start a thread: give fewer --jobs, or allow more threads and processes (`ulimit -u`)",
                exit_bad_input);
}

std::terminate_handler previous_terminate = nullptr;

/// TBB, below the ray caster, throws where nobody can catch when it cannot start a thread.
[[noreturn]] void end_without_thread() {
  try {
    if (std::current_exception()) throw;
  } catch (const std::exception& error) {
    if (std::string_view(error.what()).find("pthread_create") != std::string_view::npos)
      std::_Exit(report_no_thread());
  } catch (...) {  // told by the handler before this one
  }
  previous_terminate();
  std::abort();
}

/// The innermost command that was given.
const CLI::App& innermost(const CLI::App& app) {
  const auto given = app.get_subcommands();
  return given.empty() ? app : innermost(*given.front());
}

/// "sextant evaluate ego".
std::string words_of(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent == nullptr ? command.get_name() : words_of(*parent) + " " + command.get_name();
}

std::vector<std::string> flag_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back(fmt::format("--{}", name));
  }
  return names;
}

std::vector<std::string> subcommand_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(sub->get_name());
  }
  return names;
}

/// What is wrong with the command line, with the nearest valid name for an unknown one.
std::string usage_message(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = innermost(app);
  const std::vector<std::string> rest = app.remaining(/*recurse=*/true);
  const auto flag =
      std::find_if(rest.begin(), rest.end(), [](const auto& word) { return word.starts_with('-'); });
  if (flag != rest.end()) {
    const std::string name = flag->substr(0, flag->find('='));
    return fmt::format("unknown flag '{}': {}", name, suggest(name, flag_names(command)));
  }
  const std::vector<std::string> names = subcommand_names(command);
  if (!rest.empty() && !names.empty()) {
    return fmt::format("unknown command '{}': {}", rest.front(), suggest(rest.front(), names));
  }
  if (!rest.empty()) return fmt::format("unexpected argument '{}'", rest.front());
  if (!names.empty()) return fmt::format("a command is missing: {}", suggest("", names));
  return fmt::format("{}; see `{} --help`", error.what(), words_of(command));
}

}  // namespace

int program(int argc, const char* const* argv, std::span<const AddCommand> commands) {
  install_interrupt_handler();
  previous_terminate = std::set_terminate(end_without_thread);
  CLI::App app(
      "Evaluation and benchmarking of multi-body visual odometry: the motion of the camera and of every "
      "moving object.",
      "sextant");
  app.footer(
      "Examples:\n  sextant data check vdo:kitti_03_demo@0-19\n  sextant run vdo:kitti_03_demo@0-19 --out "
      "out\n"
      "Exit codes: 0 done, 2 bad input or usage, 130 interrupted, 70 internal error.");
  app.set_version_flag("--version", fmt::format("sextant {} ({})", version(), git_commit()));
  app.require_subcommand(1);
  for (const AddCommand add : commands) add(app);

  try {
    app.parse(argc, argv);
    return exit_ok;
  } catch (const Finished& finished) {
    return finished.code;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return report(usage_message(app, error), exit_bad_input);
  } catch (const Error& error) {
    return report(error.what(), exit_bad_input);
  } catch (const Interrupted&) {
    return report("interrupted; sweep and reproduce go on when the same command is given again",
                  exit_interrupted);
  } catch (const std::filesystem::filesystem_error& error) {  // a folder of the user's: loops, no permission
    return report(fmt::format("{}: {}: expected a file or folder that this user may read and write",
                              error.path1().string(), error.code().message()),
                  exit_bad_input);
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) return report_no_thread();
    return report(fmt::format("internal: {}", error.what()), exit_internal);
  } catch (const std::exception& error) {
    return report(fmt::format("internal: {}", error.what()), exit_internal);
  }
}

}  // namespace sextant
