#pragma once

// Random access to binary files that does not trust any length in them: a length is compared with the bytes
// that exist before memory is allocated.

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/new_file.h"

namespace sextant {

/// A file, or bytes in memory.
class ByteSource {
 public:
  /// Throws Error if the file cannot be read.
  explicit ByteSource(const std::string& path, const FileKind& kind = recording_file);
  ByteSource(std::string_view bytes, std::string name)
      : name_(std::move(name)), memory_(bytes), size_(bytes.size()) {}

  const std::string& name() const { return name_; }
  uint64_t size() const { return size_; }
  bool is_in_memory() const { return !file_; }
  /// Returns `n` bytes at `at`, valid until the next call. Throws Error if the file ends before, and if more
  /// than largest_block bytes of a file are requested.
  std::string_view view(uint64_t at, uint64_t n);

 private:
  std::string name_;
  std::optional<FileReader> file_;
  std::string_view memory_;
  uint64_t size_ = 0;
  std::vector<char> block_;  // part of the file, beginning at block_at_
  uint64_t block_at_ = 0;
};

/// Reads consecutive little-endian values. Throws Error "WHERE: ..." if the bytes end before.
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
    if (n > remaining())
      fail("{}: asks for {} bytes where {} are left: the file is damaged", where_, n, remaining());
    const std::string_view out = bytes_.substr(at_, static_cast<size_t>(n));
    at_ += out.size();
    return out;
  }
  /// Reads a 32-bit length and returns that many bytes.
  std::string_view text() { return take(number<uint32_t>()); }
  uint64_t remaining() const { return bytes_.size() - at_; }

 private:
  std::string_view bytes_;
  const std::string& where_;
  size_t at_ = 0;
};

/// Largest size in bytes of a block of a recording, compressed or not (256 MB).
constexpr uint64_t largest_block = uint64_t{1} << 28;

/// Decompresses the chunks of one file, which together may decompress to 16 MB plus 200 times the size of the
/// file. A recording of poses reaches a tenth of that, a decompression bomb several thousand times its size.
class Decompressor {
 public:
  explicit Decompressor(uint64_t file_bytes) : left_(uint64_t{16'000'000} + 200 * file_bytes) {}

  /// Returns the decompressed bytes. `kind`: lz4 (frame format), zstd or bz2. Memory grows with the actual
  /// output, not with the declared `size`. Throws Error "WHERE: ..." on damage, on another kind, and if the
  /// output has another size than `size` or exceeds largest_block or the file's limit.
  std::string decompress(std::string_view kind, std::string_view bytes, uint64_t size,
                         const std::string& where);

 private:
  uint64_t left_;
};

/// A file in memory, for readers that require a path.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes);
  std::string path() const;

 private:
  Descriptor file_;
};

}  // namespace sextant
