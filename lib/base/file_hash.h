#pragma once

// SHA-256 of a file of any size, read piece by piece.

#include <filesystem>
#include <string>

namespace sextant {

/// Lower-case hexadecimal SHA-256 of the content of a regular file, as sha256sum prints it. Throws Error that names the path
/// and the system's reason.
std::string file_sha256(const std::filesystem::path& path);

}  // namespace sextant
