#pragma once

// Safe paths for output and caches: file names made from untrusted text, folders below an output folder, and
// private folders whose content is trusted.
//
// Output is written only into the folder that the command line names and its subfolders: a name that comes
// from a file goes through safe_file_name(), and a subfolder is never reached through a link.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace sextant {

/// Turns a text into the name of one file or folder: '/' and control characters become '-', a leading '.'
/// becomes '_', and a name of more than 200 bytes is cut and ends in 16 digits of the SHA-256 of the text.
/// Other texts stay unchanged.
std::string safe_file_name(std::string_view text);

/// Appends "-2", "-3", ... to names that occur earlier in the list.
std::vector<std::string> distinct_names(std::vector<std::string> names);

/// Creates the folder `relative` below the existing folder `root` and returns its path. Throws Error if a
/// component of `relative` is a link or a file, or if the path leads out of `root`.
std::filesystem::path make_folder_below(const std::filesystem::path& root,
                                        const std::filesystem::path& relative);

/// Moves a file to `relative` below `root`, with the checks of make_folder_below(); an existing file or link
/// of that name is replaced.
void move_below(const std::filesystem::path& from, const std::filesystem::path& root,
                const std::filesystem::path& relative);

/// Throws Error unless the folder belongs to the user of this process and nobody else may write to it,
/// because its content is trusted. A folder that does not exist passes.
void check_private_folder(const std::filesystem::path& folder);

/// Creates a folder, with its parents, that only this user can enter; applies check_private_folder() to an
/// existing one.
void make_private_folder(const std::filesystem::path& folder);

}  // namespace sextant
