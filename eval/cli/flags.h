#pragma once

// Declares the flags of a command in one line each, and the flags that several commands share.

#include <cmath>
#include <concepts>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "sextant/base/options.h"
#include "sextant/base/text.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/view/viewed_run.h"

namespace sextant {

struct SweepConfig;
struct SweepOutcome;
struct Table;

/// Validator that refuses NaN, infinities and values below `least`. CLI11's own ranges accept NaN, and
/// print their largest number in full.
inline CLI::Validator finite_number(double least = -std::numeric_limits<double>::infinity()) {
  return CLI::Validator(
      [least](const std::string& text) {
        const std::optional<double> value = number_in(text);
        if (value && std::isfinite(*value) && *value >= least) return std::string();
        const std::string expected = std::isfinite(least) ? fmt::format(" of at least {}", least) : "";
        return fmt::format("expected a finite number{}, got '{}'", expected, text);
      },
      "");
}

namespace internal {
template <typename T>
inline constexpr bool is_real = std::floating_point<T>;
template <typename T>
inline constexpr bool is_real<std::optional<T>> = std::floating_point<T>;
}  // namespace internal

/// A subcommand, and the flags that its callback receives.
template <typename Flags>
struct FlaggedCommand {
  CLI::App& command;
  Flags& flags;
};

/// Adds a subcommand that calls run(flags), or run(flags, command), with the flags that were given.
template <typename Flags, typename Run>
FlaggedCommand<Flags> add_command(CLI::App& app, const std::string& name, const std::string& description,
                                  const Run& run) {
  const auto flags = std::make_shared<Flags>();
  CLI::App* const command = app.add_subcommand(name, description);
  command->callback([flags, command, run] {
    if constexpr (std::invocable<Run, Flags&>)
      run(*flags);
    else
      run(*flags, *command);
  });
  return {*command, *flags};
}

/// Formats a table for standard output; on a terminal, long texts in it are broken so that it fits.
std::string screen_text(const Table& table);
inline void print_json(const Json& json) { fmt::print("{}", json_text(json)); }

/// Adds a flag with a value. `type` stands for the value in the help, e.g. "DIR"; a choice is written
/// "this|that" (command_tree.h).
template <typename T>
CLI::Option* add_value(CLI::App& command, const std::string& flag, T& value, const std::string& type,
                       const std::string& help) {
  CLI::Option* option = command.add_option(flag, value, help)->type_name(type);
  if constexpr (internal::is_real<T>) option->check(finite_number());
  return option;
}

// ---- flags that several commands have

struct CommonFlags {
  std::string data_root;          ///< --data or SEXTANT_DATA
  std::string options;            ///< --options
  std::vector<std::string> sets;  ///< --set key=value
  int jobs = 0;
  bool quiet = false;
  bool json = false;
};

/// Adds a flag whose values are the names of an enumeration; any other value is an Error that suggests the
/// nearest name.
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

/// --source, --estimator, --level and --seed: one case of a folder with many.
void add_case_flags(CLI::App& command, CaseChoice& choice);

/// Parses SOURCE, relative to --data, with the options below "source" of --options and --set. Any other
/// option is an Error.
SourceSpec source_of(const std::string& text, const CommonFlags& flags);

/// Prints the first twenty problems on stderr as warnings, then the number of further ones.
void warn_of_problems(std::span<const std::string> problems);

/// Parses the value of --shard, "I/N". Throws Error if it has another form.
std::pair<uint64_t, uint64_t> shard_of(const std::string& text);

/// Sets the cache of a sweep, its jobs, whether it is quiet, and that its messages are printed as notes.
void set_common(const std::string& cache, const CommonFlags& flags, SweepConfig& config);

/// Prints the summary of a sweep, after `sweep` and after `rescore` of a sweep.
void print_sweep(const SweepOutcome& outcome, const std::string& out, const CommonFlags& flags);

/// Returns one line "NAME  description" per estimator, for help texts.
std::string estimator_list();

}  // namespace sextant
