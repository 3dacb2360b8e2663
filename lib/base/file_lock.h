#pragma once

// Lock of a file that only one process holds at a time, on this host or another.
//
// The lock is flock() if the file system supports it: it ends with its process, however that ends. File
// systems of clusters may not support it (ENOLCK, ENOSYS, EOPNOTSUPP); then the lock is a file FILE.lock that
// names host and process and that only one process can create. A process that no longer exists on this host
// has lost such a lock; for another host this cannot be determined, and the message names the host and the
// file to remove.

#include <sys/file.h>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace sextant {

class FileLock {
 public:
  using Flock = int (*)(int file, int operation);  ///< ::flock, replaced in tests

  /// Takes the lock of `file`, and creates the file if needed. Returns nullopt if another process holds the
  /// lock; `holder` then describes it, as far as known. Throws Error with the system's reason if the state
  /// cannot be determined.
  static std::optional<FileLock> take(const std::filesystem::path& file, std::string* holder = nullptr,
                                      Flock flock = ::flock);
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

 private:
  FileLock(int descriptor, std::filesystem::path lock_file)
      : descriptor_(descriptor), lock_file_(std::move(lock_file)) {}

  int descriptor_ = -1;
  std::filesystem::path lock_file_;  ///< the lock file on file systems without flock(); otherwise empty
};

// Lock of a folder into which only one process writes at a time. A command that writes into a folder takes
// the lock before anything else; a second command ends with an error.
//
// The lock is flock() on the folder itself, which leaves no file and ends with its process. If the file
// system does not allow that for folders (NFS), the file FOLDER/.lock is locked (FileLock).

class FolderLock {
 public:
  /// Creates the folder if needed, and takes its lock; a process that already holds the lock shares it with
  /// itself. Throws Error if another process holds the lock, or if the folder is a file or cannot be created.
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  struct
      /// ends with the last FolderLock of its folder; removes the folders that it created and that are empty
      Held;
  std::shared_ptr<Held> held_;
};

}  // namespace sextant
