#pragma once

// A file descriptor that closes itself.

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

// A folder of its own below the system's temporary one, named `prefix` and six letters that no other has, not
// even one that a killed process has left. Removed with everything in it at the end. Throws Error where none
// can be made.

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

// A file that is written under a temporary name beside its place and gets its name when it is whole.
//
// The temporary name cannot be foreseen, and the file is created exclusively (O_EXCL, O_NOFOLLOW): in a
// folder that others may write to, nobody can put a link there through which another file would be
// overwritten. Every temporary file of the project is made here or lies in a ScratchFolder.

class NewFile {
 public:
  /// Creates PATH.tmp and 16 random hexadecimal digits. Throws Error that names the path and the system's
  /// reason, also when `path` is a folder, pipe or device.
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
