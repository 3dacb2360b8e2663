#pragma once

// Lock of a file that only one process holds at a time, on this host or another.
//
// The lock is flock() if the file system supports it: it ends with its process, however the process ends.
// File systems of clusters may not support it (ENOLCK, ENOSYS, EOPNOTSUPP); then the lock is a file
// FILE.lock, which only one process can create and which contains the names of host and process. If that
// process no longer exists on this host, its lock is taken over. For a process on another host this cannot be
// determined, so the message names the host and the file to remove.

#include <sys/file.h>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "sextant/base/new_file.h"

namespace sextant {

class FileLock {
 public:
  using Flock = int (*)(int file, int operation);  ///< ::flock, replaced in tests

  /// Takes the lock of `file`, and creates the file if needed. Returns nullopt if another process holds the
  /// lock; `holder` then describes that process, as far as known. Throws Error if `file` is a link, and with
  /// the system's reason if it cannot be opened or the state of the lock cannot be determined.
  static std::optional<FileLock> take(const std::filesystem::path& file, std::string* holder = nullptr,
                                      Flock flock = ::flock);
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

 private:
  explicit FileLock(Descriptor descriptor) : descriptor_(std::move(descriptor)) {}

  Descriptor descriptor_;
  std::filesystem::path lock_file_;  ///< the lock file on file systems without flock(); otherwise empty
};

// Lock of a folder into which only one process writes at a time. A command that writes into a folder takes
// the lock before anything else; a second command ends with an error.
//
// The lock is flock() on the folder itself, which leaves no file and ends with its process. If the file
// system does not allow that for folders (NFS), the file FOLDER/.lock is locked (FileLock).

class FolderLock {
 public:
  /// Creates the folder if needed, and takes its lock. Several FolderLocks of one process for the same folder
  /// share the lock. Throws Error if another process holds the lock, or if the folder is a file or cannot be
  /// created or opened.
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  /// State that the FolderLocks of one folder share. The last one releases the lock and removes the folders
  /// that the first one created, if they are empty.
  struct Held;
  std::shared_ptr<Held> held_;
};

}  // namespace sextant
