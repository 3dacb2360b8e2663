#pragma once

// Reading whole files, remembering what was read, and writing files so that a reader never sees half of one.

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace sextant {

namespace fs = std::filesystem;

/// What a file is read as, and how large it may be then:
/// a larger one is refused before anything of it is read.
struct FileKind {
  const char* name;
  uint64_t max_bytes;
};
inline constexpr FileKind data_file = {"a file of data", uint64_t{1} << 30U};
inline constexpr FileKind json_file = {"a JSON file", uint64_t{1} << 28U};
inline constexpr FileKind records_file = {"a file of records, a journal or a pack", uint64_t{1} << 33U};
/// What is never in memory as a whole.
inline constexpr FileKind streamed_file = {"a file", uint64_t{1} << 50U};
inline constexpr FileKind recording_file = {"a recording", uint64_t{1} << 50U};

/// A regular file open for reading. Throws Error that names the path and the system's reason, or the limit.
class FileReader {
 public:
  FileReader(const fs::path& path, const FileKind& kind);
  FileReader(FileReader&& other) noexcept
      : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)), size_(other.size_) {}
  FileReader& operator=(FileReader&&) = delete;
  ~FileReader();

  uint64_t size() const { return size_; }  ///< when it was opened
  /// `n` bytes from `at` on; returns how many there were.
  size_t read(char* to, size_t n, uint64_t at) const;

 private:
  std::string path_;
  int file_ = -1;
  uint64_t size_ = 0;
};

/// The bytes of a file. Throws Error that names the path and the system's reason, or the limit.
std::string read_file(const fs::path& path, const FileKind& kind = data_file);

/// Writes to a temporary name in the same folder, makes it durable, then renames: after a power cut either
/// the old or the new file is there. Throws Error; leaves no temporary behind.
void write_file(const fs::path& path, std::string_view bytes);

/// A file that is written piece by piece, durable after close(). Throws Error that names the path and the
/// reason.
class StreamedFile {
 public:
  explicit StreamedFile(fs::path path);
  ~StreamedFile();
  StreamedFile(const StreamedFile&) = delete;
  StreamedFile& operator=(const StreamedFile&) = delete;

  void append(std::string_view bytes);
  void close();

 private:
  void flush();

  fs::path path_;
  std::string buffer_;
  int file_ = -1;
};

/// Makes names durable: files that were made, renamed or removed in `folder` before are so after a power cut.
void sync_folder(const fs::path& folder);

/// Lower-case hexadecimal SHA-256.
std::string sha256(std::string_view bytes);

/// Every input file that a run has read, for its provenance. Safe to use from several threads.
class InputLog {
 public:
  struct Entry {
    uint64_t bytes = 0;
    std::string sha256;
  };

  /// read_file() of data that remembers size and SHA-256.
  std::string read(const fs::path& path);

  /// What was read, in order of path.
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

// SHA-256 of a file of any size, read piece by piece.

/// Lower-case hexadecimal SHA-256 of the content of a regular file, as sha256sum prints it. Throws Error that
/// names the path and the system's reason.
std::string file_sha256(const std::filesystem::path& path);

/// Path of the file that a FileReader (files.h) of any thread opened last; empty before the first. Memory is
/// asked for in proportion to what files hold, so this is the file that a message about lack of memory names.
std::string last_opened_file();

}  // namespace sextant
