#pragma once

// A file that is written under a temporary name beside its place and gets its name when it is whole.
//
// The temporary name cannot be foreseen, and the file is created exclusively (O_EXCL, O_NOFOLLOW): in a folder that others
// may write to, nobody can put a link there through which another file would be overwritten. Every temporary file of the
// project is made here or lies in a ScratchFolder.

#include <filesystem>
#include <string>
#include <string_view>

#include "sextant/base/descriptor.h"

namespace sextant {

class NewFile {
 public:
  /// Creates PATH.tmp and 16 random hexadecimal digits. Throws Error that names the path and the system's reason, also when
  /// `path` is a folder, pipe or device.
  explicit NewFile(std::filesystem::path path);
  /// Removes the file unless commit() was called.
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  /// Open for reading and writing.
  int descriptor() const { return file_.get(); }
  /// For libraries that open a file by its name.
  const std::filesystem::path& temporary() const { return temporary_; }
  void append(std::string_view bytes) const;
  /// Makes the file durable and gives it its name; a file or link that has this name is replaced.
  void commit();

 private:
  [[noreturn]] void give_up(const char* what) const;

  std::filesystem::path path_, temporary_;
  Descriptor file_;
};

/// Writes all bytes to a descriptor. Returns false, with errno, when not all could be written.
bool write_all(int file, std::string_view bytes);

}  // namespace sextant
