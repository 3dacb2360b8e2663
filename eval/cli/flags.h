#pragma once

// Flags of a command, in one line each.

#include <CLI/CLI.hpp>
#include <string>

namespace sextant {

/// `type`: what stands for the value in the help, "DIR"; a choice is written "this|that" (command_tree.h).
template <typename T>
CLI::Option* add_value(CLI::App& command, const std::string& flag, T& value, const std::string& type,
                       const std::string& help) {
  return command.add_option(flag, value, help)->type_name(type);
}

}  // namespace sextant
