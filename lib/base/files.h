#pragma once

// Reading whole files, remembering what was read, and writing files so that a reader never sees half of one.

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

namespace sextant {

/// The bytes of a file. Throws Error that names the path and the system's reason.
std::string read_file(const std::filesystem::path& path);

/// Writes to a temporary name in the same folder, then renames. Throws Error; leaves no temporary behind.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Lower-case hexadecimal SHA-256.
std::string sha256(std::string_view bytes);

/// Every input file that a run has read, for its provenance. Safe to use from several threads.
class InputLog {
 public:
  struct Entry {
    uint64_t bytes = 0;
    std::string sha256;
  };

  /// read_file() that remembers size and SHA-256.
  std::string read(const std::filesystem::path& path);

  /// What was read, in order of path.
  std::map<std::string, Entry> entries() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
};

}  // namespace sextant
