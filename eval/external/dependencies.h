#pragma once

// The files that the patterns of "depends" match (program_fingerprint.h says which).

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "sextant/eval/external/external_config.h"

namespace sextant {

struct Dependencies {
  std::set<std::filesystem::path> files;  ///< absolute, without "." and ".."
  std::vector<std::string> not_seen;
};

/// Patterns are relative to `folder`. Throws Error where one matches no file, the default apart.
Dependencies find_dependencies(const FilePatterns& patterns, const std::filesystem::path& folder);

}  // namespace sextant
