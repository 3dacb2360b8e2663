#pragma once

// An output folder that is either complete or not there, and where its content comes from.

#include <filesystem>
#include <map>
#include <string>

#include "sextant/base/json.h"

namespace sextant {

/// Path relative to the output folder -> bytes.
using OutputFiles = std::map<std::string, std::string>;

/// Version, build and machine: what every run.json begins with.
Json build_provenance();
/// Throws Error when `folder` cannot take the results of `configuration` (resolved_configuration()): it is a
/// file, or it holds the records of another configuration and `force` is off. A run may be repeated in place.
void check_output_folder(const std::filesystem::path& folder, const Json& configuration, bool force);

/// Creates the folder where needed, writes every file into a subfolder of it and moves them into place when
/// all are there. When anything fails (or Ctrl-C comes) before, removes what it has written and created:
/// earlier results are as they were. Rethrows.
void write_output_folder(const std::filesystem::path& folder, const OutputFiles& files);

}  // namespace sextant
