#pragma once

// Writes zip files, and numpy arrays in them, for `sextant export` and evo's result files. Equal content
// gives equal bytes. Errors name the file.

#include <filesystem>
#include <string>
#include <string_view>

#include "sextant/base/new_file.h"

namespace sextant {

/// A zip file under construction, under a temporary name next to `path`; removed unless finish() is called.
class ZipFile {
 public:
  /// `level`: deflate level, 0 (stored) to 9.
  explicit ZipFile(const std::filesystem::path& path, int level = 0);
  ~ZipFile();
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  void add(const std::string& name, std::string_view bytes);
  // Adds a file of `n_bytes` piece by piece.
  void begin(const std::string& name, uint64_t n_bytes);
  void append(std::string_view bytes);
  void end();
  /// Completes the archive, syncs it to disk and renames it to its final name.
  void finish();

 private:
  void expect(bool good, const std::string& what) const;

  std::filesystem::path path_;
  NewFile file_;
  std::string name_;
  int level_;
  void* zip_ = nullptr;
};

/// Returns the header of an array in a .npy file: `type` such as "<f8", `shape` such as "(3,)".
std::string npy_header(std::string_view type, std::string_view shape);

}  // namespace sextant
