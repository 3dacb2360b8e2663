#pragma once

// Fingerprint of an external program (records/fingerprint.h), by content, never by place or time: equal files in another
// folder or on another machine have the same. Its parts:
//
//   configuration    every option of CONFIG, with what the plan changes
//   the program      the file that the first word of `command` names, looked up as run_process() does
//   interpreter      what its first line "#! ..." names; `env` is passed through
//   arguments        every further word, or what follows a '=' in it, that names a file
//   settings         the template
//   depends          the files that match its patterns
//
// A part in the folder of CONFIG or below is named by its path from there, another one as the configuration names it.
// Nobody sees shared libraries, packages of an interpreter, files outside that only the program knows, variables of the
// environment, nor what a word says that depends on the case ({input}, {seed}).
//
// Patterns with * or ? pass over names that begin with a dot, __pycache__, and what Sextant itself writes: folders of
// results, reports and packs, and plans. ** does not follow links to folders. The pattern "**" alone, which is the
// default, moreover passes over files above most_bytes_beside, *.log, *.tmp, *.pyc, *~, and the files that stdout and stderr
// of this process go to; where it finds more than most_files_beside it keeps to the folder itself.

#include <filesystem>

#include "sextant/eval/external/external_config.h"
#include "sextant/eval/records/fingerprint.h"

namespace sextant {

inline constexpr uint64_t most_bytes_beside = 10'000'000;
inline constexpr size_t most_files_beside = 2000;

/// Of the program of `file`, which is CONFIG. Throws Error where a pattern of `depends` matches no file, or a file cannot be
/// read. A program that is not there is not seen: starting it says why.
Fingerprint program_fingerprint(const ExternalConfig& config, const std::filesystem::path& file);

}  // namespace sextant
