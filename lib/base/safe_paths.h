#pragma once

// Where files of ours may lie: names made of texts that come from files, folders below an output folder, and
// folders whose content is trusted.
//
// Output is written into the folder that the command line names and below it, nowhere else: a name that comes
// from a file goes through safe_file_name(), and a folder below the output folder is never reached through a
// link.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace sextant {

/// A text as the name of one file or folder: '/' and control characters become '-', a leading '.' becomes
/// '_', and a name of more than 200 bytes ends in 16 digits of the SHA-256 of the text. Other texts stay as
/// they are.
std::string safe_file_name(std::string_view text);

/// The names with "-2", "-3", ... after those that an earlier one has.
std::vector<std::string> distinct_names(std::vector<std::string> names);

/// Makes the folder `relative` below `root`, which exists, and returns its path. Throws Error when a part of
/// `relative` is a link or a file, or leads out of `root`.
std::filesystem::path make_folder_below(const std::filesystem::path& root,
                                        const std::filesystem::path& relative);

/// Moves a file to `relative` below `root`, with the same promise; a file or link of that name is replaced.
void move_below(const std::filesystem::path& from, const std::filesystem::path& root,
                const std::filesystem::path& relative);

/// Throws Error unless the folder belongs to the user of this process and nobody else may write to it: what
/// is read there is taken for our own. A folder that is not there passes.
void check_private_folder(const std::filesystem::path& folder);

/// Makes a folder that only this user can enter, with the folders above it; check_private_folder() where it
/// is there.
void make_private_folder(const std::filesystem::path& folder);

}  // namespace sextant
