#pragma once

// The files that match the patterns of "depends" (defined in program_fingerprint.h).

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

/// Finds the files; patterns are relative to `folder`. Throws Error if a pattern other than the default
/// matches no file.
Dependencies find_dependencies(const FilePatterns& patterns, const std::filesystem::path& folder);

}  // namespace sextant
