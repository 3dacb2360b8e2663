#pragma once

// One process at a time, on this host or another, holds the lock of a file.
//
// flock() where the file system has it: the lock ends with its process, however that ends. File systems of
// clusters may have none (ENOLCK, ENOSYS, EOPNOTSUPP); there the lock is a file FILE.lock that names host and
// process and is made by one of them only. A process that is gone from this host has lost such a lock; of
// another host nobody can tell, and the message says whom to ask and what to remove.

#include <sys/file.h>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace sextant {

class FileLock {
 public:
  using Flock = int (*)(int file, int operation);  ///< ::flock, another in tests

  /// The lock of `file`, which is made where it is not there; nothing when another process holds it, with
  /// `holder` saying who, as far as that is known. Throws Error with the system's reason when it cannot be
  /// known.
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

// One process at a time writes into a folder. A command that writes a folder takes its lock before anything
// else; the second command ends with an error that says so.
//
// The lock is flock() on the folder itself, which leaves no file and ends with its process. Where the file
// system refuses that for folders (NFS), the lock is that of the file FOLDER/.lock (file_lock.h).

class FolderLock {
 public:
  /// Makes the folder where it is not there, and takes its lock; a process that holds it already shares it
  /// with itself. Throws Error when another process holds the lock, or the folder is a file or cannot be
  /// made.
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  /// Ends with the last FolderLock of its folder, and removes the folders that it made and that are empty.
  struct Held;
  std::shared_ptr<Held> held_;
};

}  // namespace sextant
