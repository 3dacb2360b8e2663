#pragma once

// One process at a time, on this host or another, holds the lock of a file.
//
// flock() where the file system has it: the lock ends with its process, however that ends. File systems of clusters may
// have none (ENOLCK, ENOSYS, EOPNOTSUPP); there the lock is a file FILE.lock that names host and process and is made by
// one of them only. A process that is gone from this host has lost such a lock; of another host nobody can tell, and the
// message says whom to ask and what to remove.

#include <sys/file.h>

#include <filesystem>
#include <optional>
#include <string>

namespace sextant {

class FileLock {
 public:
  using Flock = int (*)(int file, int operation);  ///< ::flock, another in tests

  /// The lock of `file`, which is made where it is not there; nothing when another process holds it, with `holder` saying
  /// who, as far as that is known. Throws Error with the system's reason when it cannot be known.
  static std::optional<FileLock> take(const std::filesystem::path& file, std::string* holder = nullptr,
                                      Flock flock = ::flock);
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

 private:
  FileLock(int descriptor, std::filesystem::path lock_file)
      : descriptor_(descriptor), lock_file_(std::move(lock_file)) {}

  int descriptor_ = -1;
  std::filesystem::path lock_file_;  ///< of the file system without flock(); else empty
};

}  // namespace sextant
