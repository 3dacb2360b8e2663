#pragma once

// Flags of a command, in one line each.

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "sextant/base/folder_lock.h"

namespace sextant {

/// `type`: what stands for the value in the help, "DIR"; a choice is written "this|that" (command_tree.h).
template <typename T>
CLI::Option* add_value(CLI::App& command, const std::string& flag, T& value, const std::string& type,
                       const std::string& help) {
  return command.add_option(flag, value, help)->type_name(type);
}

/// The lock of an output folder, taken before anything is read or computed; none where no folder is given.
inline std::optional<FolderLock> lock_folder(const std::string& folder) {
  return folder.empty() ? std::nullopt : std::optional(FolderLock(folder));
}

}  // namespace sextant
