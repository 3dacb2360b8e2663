#pragma once

// Flags of a command, in one line each.

#include <CLI/CLI.hpp>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <string>

#include "sextant/base/folder_lock.h"
#include "sextant/base/text.h"

namespace sextant {

/// Refuses nan, infinities and what is below `least`. CLI11's ranges let nan pass, and print their largest number in full.
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

/// `type`: what stands for the value in the help, "DIR"; a choice is written "this|that" (command_tree.h).
template <typename T>
CLI::Option* add_value(CLI::App& command, const std::string& flag, T& value, const std::string& type,
                       const std::string& help) {
  CLI::Option* option = command.add_option(flag, value, help)->type_name(type);
  if constexpr (internal::is_real<T>) option->check(finite_number());
  return option;
}

/// The lock of an output folder, taken before anything is read or computed; none where no folder is given.
inline std::optional<FolderLock> lock_folder(const std::string& folder) {
  return folder.empty() ? std::nullopt : std::optional(FolderLock(folder));
}

}  // namespace sextant
