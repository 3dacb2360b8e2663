#pragma once

// run.json, the provenance of a folder of results: what this program writes about itself, and reading the
// file.

#include <filesystem>
#include <string>

#include "sextant/base/json.h"

namespace sextant {

std::string version();
/// Returns the commit of the source tree, with "-dirty" if it had changes; "unknown" outside git.
std::string git_commit();
/// Returns version and commit of this program; all results of one sweep must have the same.
Json program_identity();
/// Returns version, build and machine, with which every run.json begins.
Json build_provenance();

/// Reads run.json of `folder`. Members that this program uses must have their types if present:
/// configuration, machine, packages and inputs are objects; sources and noise are lists of objects with a
/// text `source`; inputs contain {"sha256"} or a text; version, git_commit, compiler and flags are texts;
/// cases is a number. Throws Error that names file and key.
Json read_run_json(const std::filesystem::path& folder);

}  // namespace sextant
