#pragma once

// run.json, the provenance of a folder of results, as others read it.

#include <filesystem>

#include "sextant/base/json.h"

namespace sextant {

/// The file in `folder`. Where they are there, the members that this program goes by have their types:
/// configuration, machine, packages, inputs are objects; sources and noise lists of objects with a text
/// `source`; inputs hold {"sha256"} or a text; version, git_commit, compiler, flags are texts; cases is a
/// number. Throws Error that names file and key.
Json read_run_json(const std::filesystem::path& folder);

}  // namespace sextant
