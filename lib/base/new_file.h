#pragma once

// Safe creation of files and folders: new files appear under their final names when they are complete, names
// made from untrusted text stay within a folder, and no link is followed.

#include <unistd.h>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sextant/base/error.h"

namespace sextant {

/// A file descriptor that is closed by its destructor.
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

/// Returns the folder for temporary files: $TMPDIR, or /tmp. It need not exist.
std::filesystem::path temporary_folder();

// A new folder in the folder for temporary files. Its name is `prefix` and six random letters and digits, so
// that it differs from every existing folder, also from one left by a killed process. The destructor removes
// the folder with its content, and so does the end of the program after Ctrl-C (base/interrupt.h). The
// constructor throws Error if the folder cannot be created.

class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& prefix);
  ~ScratchFolder();
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
// Every temporary file of the project is made by this class, or lies in a folder that only this user can
// enter: a ScratchFolder, the folder .incomplete of an OutputFolder, or another one made by mkdtemp().

class NewFile {
 public:
  /// Creates the temporary file, named `path` followed by ".tmp" and 16 random hexadecimal digits. Throws
  /// Error if `path` is a folder, pipe or device, and with the system's reason if the file cannot be created.
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
  /// replaced. Throws Error with the system's reason.
  void commit();

 private:
  [[noreturn]] void give_up(const char* what) const;

  std::filesystem::path path_, temporary_;
  Descriptor file_;
};

/// Writes all bytes to a descriptor. Returns false and sets errno if not all could be written.
bool write_all(int file, std::string_view bytes);

// ---- Safe paths for output and caches: file names made from untrusted text, folders below an output folder,
// and private folders whose content is trusted.
//
// Output is written only into the folder that the command line names and its subfolders: a name that comes
// from a file goes through safe_file_name(), and a subfolder is never reached through a link.

/// Turns a text into the name of one file or folder: '/' and ASCII control characters become '-', a leading
/// '.' becomes '_', and a name of more than 200 bytes is cut and ends in 16 hexadecimal digits of the SHA-256
/// of the text. An empty text becomes "_"; other texts stay unchanged.
std::string safe_file_name(std::string_view text);

/// Returns the names, with "-2", "-3", ... appended to each one that occurs earlier in the list, so that all
/// differ.
std::vector<std::string> distinct_names(std::vector<std::string> names);

/// Creates the folder `relative` below the existing folder `root` and returns its path. Throws Error if
/// `relative` is empty, absolute or contains "..", and if one of its components is a link or a file or cannot
/// be created.
std::filesystem::path make_folder_below(const std::filesystem::path& root,
                                        const std::filesystem::path& relative);

/// Moves a file to `relative` below `root`. Creates and checks the folders on the way like
/// make_folder_below(); an existing file or link of that name is replaced.
void move_below(const std::filesystem::path& from, const std::filesystem::path& root,
                const std::filesystem::path& relative);

/// Throws Error unless the folder belongs to the user of this process and nobody else may write to it,
/// because its content is trusted. A folder that does not exist passes.
void check_private_folder(const std::filesystem::path& folder);

/// Creates a folder that only this user can enter, with its parents; applies check_private_folder() also to
/// an existing folder. Throws Error if the folder cannot be created or fails the check.
void make_private_folder(const std::filesystem::path& folder);

}  // namespace sextant
