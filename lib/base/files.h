#pragma once

// Reading whole files with a size limit, recording which files were read, and writing files atomically.

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "sextant/base/new_file.h"

namespace sextant {

namespace fs = std::filesystem;

/// Name of a kind of file in messages, and the largest size that is accepted. A larger file is refused before
/// any of it is read.
struct FileKind {
  const char* name;
  uint64_t max_bytes;
};
inline constexpr FileKind data_file = {"a file of data", uint64_t{1} << 30U};
inline constexpr FileKind json_file = {"a JSON file", uint64_t{1} << 28U};
inline constexpr FileKind records_file = {"a file of records, a journal or cached correspondences",
                                          uint64_t{1} << 33U};
/// Files that are read piece by piece and never held in memory as a whole.
inline constexpr FileKind streamed_file = {"a file", uint64_t{1} << 50U};
inline constexpr FileKind recording_file = {"a recording", uint64_t{1} << 50U};

/// A regular file that is open for reading. Throws Error with the path and the reason: that of the system, or
/// that the file is a folder, pipe or device, or larger than its kind may be.
class FileReader {
 public:
  FileReader(const fs::path& path, const FileKind& kind);

  uint64_t size() const { return size_; }  ///< size in bytes when the file was opened
  /// Reads up to `n` bytes from offset `at` into `to`; returns the number of bytes read, which is smaller
  /// than `n` only at the end of the file.
  size_t read(char* to, size_t n, uint64_t at) const;

 private:
  std::string path_;
  Descriptor file_;
  uint64_t size_ = 0;
};

/// Returns the content of a file. Throws Error like FileReader.
std::string read_file(const fs::path& path, const FileKind& kind = data_file);

/// Writes `bytes` to a temporary file in the same folder, syncs it to disk and renames it to `path`: after a
/// power cut either the old or the new file exists. If it fails, throws Error and leaves no temporary file
/// behind.
void write_file(const fs::path& path, std::string_view bytes);

/// A new file that is written piece by piece and synced to disk by close(). Throws Error with the path and
/// the system's reason, also if the file already exists.
class StreamedFile {
 public:
  explicit StreamedFile(fs::path path);

  void append(std::string_view bytes);
  void close();

 private:
  void flush();

  fs::path path_;
  std::string buffer_;
  Descriptor file_;
};

/// Syncs a folder to disk, so that files created, renamed or removed in it before survive a power cut.
void sync_folder(const fs::path& folder);

/// Returns the SHA-256 in lower-case hexadecimal.
std::string sha256(std::string_view bytes);

/// Records every input file that a run reads, for its provenance. Safe to use from several threads.
class InputLog {
 public:
  struct Entry {
    uint64_t bytes = 0;
    std::string sha256;
  };

  /// Returns read_file(path) of a data file, and records its size and SHA-256.
  std::string read(const fs::path& path);

  /// Returns the recorded files, ordered by path.
  std::map<std::string, Entry> entries() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
};

// ---- text files compiled into the program by sextant_embed() (cmake/SextantEmbed.cmake)

struct EmbeddedFile {
  std::string_view name;
  std::string_view text;
};

/// Returns the SHA-256 of a regular file of any size in lower-case hexadecimal, as sha256sum prints it; the
/// file is read piece by piece. Throws Error with the path and the system's reason.
std::string file_sha256(const std::filesystem::path& path);

/// Returns the path of the file that any FileReader of the program opened last; empty before the first.
/// Memory use is proportional to the size of the input, so a message about exhausted memory names this file.
std::string last_opened_file();

}  // namespace sextant
