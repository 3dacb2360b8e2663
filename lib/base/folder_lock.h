#pragma once

// One process at a time writes into a folder. A command that writes a folder takes its lock before anything else; the second
// command ends with an error that says so.
//
// The lock is flock() on the folder itself, which leaves no file and ends with its process. Where the file system refuses
// that for folders (NFS), the lock is that of the file FOLDER/.lock (file_lock.h).

#include <filesystem>
#include <memory>

namespace sextant {

class FolderLock {
 public:
  /// Makes the folder where it is not there, and takes its lock; a process that holds it already shares it with itself.
  /// Throws Error when another process holds the lock, or the folder is a file or cannot be made.
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  struct Held;  ///< ends with the last FolderLock of its folder, and removes the folders that it made and that are empty
  std::shared_ptr<Held> held_;
};

}  // namespace sextant
