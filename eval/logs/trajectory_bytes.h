#pragma once

// Binary files, read at any place without trusting a length in them: what a length asks for is compared with
// what is there before memory is taken.

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"

namespace sextant {

/// A file, or bytes in memory.
class ByteSource {
 public:
  /// Throws Error when the file cannot be read.
  explicit ByteSource(const std::string& path, const FileKind& kind = recording_file);
  ByteSource(std::string_view bytes, std::string name)
      : name_(std::move(name)), memory_(bytes), size_(bytes.size()) {}

  const std::string& name() const { return name_; }
  uint64_t size() const { return size_; }
  bool is_in_memory() const { return !file_; }
  /// `n` bytes at `at`, valid until the next call. Throws Error where the file ends before.
  std::string_view view(uint64_t at, uint64_t n);

 private:
  std::string name_;
  std::optional<FileReader> file_;
  std::string_view memory_;
  uint64_t size_ = 0;
  std::vector<char> block_;  // of the file, from block_at_ on
  uint64_t block_at_ = 0;
};

/// Little-endian values one after the other. Throws Error "WHERE: ..." where the bytes end before.
class ByteCursor {
 public:
  ByteCursor(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}

  template <typename T>
  T number() {
    T value;
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }
  std::string_view take(uint64_t n) {
    if (n > remaining()) fail("{}: asks for {} bytes where {} are left: damaged", where_, n, remaining());
    const std::string_view out = bytes_.substr(at_, static_cast<size_t>(n));
    at_ += out.size();
    return out;
  }
  /// A length of 32 bits and as many bytes.
  std::string_view text() { return take(number<uint32_t>()); }
  uint64_t remaining() const { return bytes_.size() - at_; }

 private:
  std::string_view bytes_;
  const std::string& where_;
  size_t at_ = 0;
};

/// The larger of what a block of a recording may hold, compressed or not.
constexpr uint64_t largest_block = uint64_t{1} << 28;

/// Decompresses the chunks of one file, which all together may unpack to 16 MB and 200 times the file: a
/// recording of poses reaches a tenth of that, a decompression bomb several thousand times its size.
class Decompressor {
 public:
  explicit Decompressor(uint64_t file_bytes) : left_(uint64_t{16'000'000} + 200 * file_bytes) {}

  /// `kind`: lz4 (frame format), zstd or bz2. Memory grows with what comes out, not with what `size` claims.
  /// Throws Error "WHERE: ..." on damage, on another size than `size`, beyond largest_block and beyond the
  /// file's limit.
  std::string decompress(std::string_view kind, std::string_view bytes, uint64_t size,
                         const std::string& where);

 private:
  uint64_t left_;
};

/// A file that lies in memory, for readers that want a path.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  std::string path() const;

 private:
  int file_ = -1;
};

}  // namespace sextant
