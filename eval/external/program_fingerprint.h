#pragma once

// Fingerprint of an external program (records/provenance.h). It depends on content only, not on location or
// time: equal files in another folder or on another machine give the same fingerprint. Its parts:
//
//   configuration    every option of CONFIG, with the changes of the plan
//   the program      the file named by the first word of `command`, found like run_process() finds it
//   interpreter      the program in its first line "#! ..."; `env` is resolved
//   arguments        every further word that names a file, or its part after '='
//   settings         the template
//   depends          the files that match its patterns
//
// A part in the folder of CONFIG or below is named by its relative path, other parts as in the configuration.
// A word that names a folder with files of which `depends` matches none is listed under `not_seen`. The
// fingerprint does not cover shared libraries, packages of an interpreter, files elsewhere that only the
// program knows, environment variables, and words that depend on the case ({input}, {seed}).
//
// Patterns with * or ? skip names that begin with a dot, __pycache__, and files written by Sextant: folders
// of results, benchmarks, reports and correspondence caches, plans and pages. ** does not follow links to
// folders. The pattern "**" alone, which is the default, also skips files above most_bytes_beside, *.log,
// *.tmp, *.pyc, *~, and the files to which stdout and stderr of this process go; if it finds more than
// most_files_beside, it is restricted to the folder itself.

#include <filesystem>

#include "sextant/eval/external/external_config.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {

inline constexpr uint64_t most_bytes_beside = 10'000'000;
inline constexpr size_t most_files_beside = 2000;

/// Returns the fingerprint of the program that `config` describes; `file` is the path of CONFIG. Throws Error
/// if a pattern of `depends` matches no file, or a file cannot be read. A program that does not exist is left
/// out, since starting it reports the error.
Fingerprint program_fingerprint(const ExternalConfig& config, const std::filesystem::path& file);

}  // namespace sextant
