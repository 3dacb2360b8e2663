#pragma once

// Descriptor: a file descriptor that is closed by its destructor.

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <unistd.h>
#include <utility>

#include "sextant/base/error.h"

namespace sextant {

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }

 private:
  int fd_;
};

// A new temporary folder in the system's temporary folder, named `prefix` and six letters that no existing
// folder has, not even one left by a killed process. The destructor removes it with everything in it. Throws
// Error if it cannot be created.

class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& prefix) {
    std::string name = (std::filesystem::temp_directory_path() / (prefix + "XXXXXX")).string();
    if (::mkdtemp(name.data()) == nullptr) fail("{}: cannot create a temporary folder", name);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// A file that is written under a temporary name in its folder and renamed to its final name when it is
// complete.
//
// The temporary name is unpredictable and the file is created exclusively (O_EXCL, O_NOFOLLOW): in a folder
// that others may write to, nobody can place a link there through which another file would be overwritten.
// Every temporary file of the project is made by this class or lies in a ScratchFolder.

class NewFile {
 public:
  /// Creates the temporary file, named `path` followed by ".tmp" and 16 random hexadecimal digits. Throws
  /// Error with the path and the system's reason, also if `path` is a folder, pipe or device.
  explicit NewFile(std::filesystem::path path);
  /// Removes the file unless commit() was called.
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  /// Descriptor of the temporary file, open for reading and writing.
  int descriptor() const { return file_.get(); }
  /// Path of the temporary file, for libraries that open a file by name.
  const std::filesystem::path& temporary() const { return temporary_; }
  void append(std::string_view bytes) const;
  /// Syncs the file to disk and renames it to its final name; an existing file or link of that name is
  /// replaced.
  void commit();

 private:
  [[noreturn]] void give_up(const char* what) const;

  std::filesystem::path path_, temporary_;
  Descriptor file_;
};

/// Writes all bytes to a descriptor. Returns false and sets errno if not all could be written.
bool write_all(int file, std::string_view bytes);

}  // namespace sextant
