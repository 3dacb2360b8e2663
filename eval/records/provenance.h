#pragma once

// run.json, the provenance of a folder of results: what this program writes there of itself, and the file as
// others read it.

#include <filesystem>
#include <string>

#include "sextant/base/json.h"

namespace sextant {

std::string version();
/// Commit of the source tree, with "-dirty" when it had changes; "unknown" outside git.
std::string git_commit();
/// Version and commit of this program: results of one sweep come from one.
Json program_identity();
/// Version, build and machine: what every run.json begins with.
Json build_provenance();

/// The file in `folder`. Where they are there, the members that this program goes by have their types:
/// configuration, machine, packages, inputs are objects; sources and noise lists of objects with a text
/// `source`; inputs hold {"sha256"} or a text; version, git_commit, compiler, flags are texts; cases is a
/// number. Throws Error that names file and key.
Json read_run_json(const std::filesystem::path& folder);

}  // namespace sextant
