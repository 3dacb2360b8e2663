#pragma once

// Writing zip files, and numpy arrays for them: what `sextant export` and evo's result files are made of. The
// same content gives the same bytes. Errors name the file.

#include <filesystem>
#include <string>
#include <string_view>

#include "sextant/base/new_file.h"

namespace sextant {

/// A zip file under construction at a temporary name beside `path`; what is not finished is removed.
class ZipFile {
 public:
  /// `level`: of deflate, 0 (stored) to 9.
  explicit ZipFile(const std::filesystem::path& path, int level = 0);
  ~ZipFile();
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  void add(const std::string& name, std::string_view bytes);
  // The same piece by piece, for a file of `n_bytes`.
  void begin(const std::string& name, uint64_t n_bytes);
  void append(std::string_view bytes);
  void end();
  /// Moves it into its place.
  void finish();

 private:
  void expect(bool good, const std::string& what) const;

  std::filesystem::path path_;
  NewFile file_;
  std::string name_;
  int level_;
  void* zip_ = nullptr;
};

/// What precedes the bytes of an array in a .npy file: `type` as "<f8", `shape` as "(3,)".
std::string npy_header(std::string_view type, std::string_view shape);

}  // namespace sextant
