#pragma once

// Writer and reader of the project's binary files, such as the correspondence cache: numbers are stored in
// the memory layout of a little-endian machine, and integers of any size as varints (groups of 7 bits, the
// lowest group first). The reader treats its bytes as untrusted input: it throws Error where they end early
// or are malformed.

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "sextant/base/error.h"

namespace sextant {

static_assert(std::endian::native == std::endian::little,
              "numbers are stored in the memory layout of a little-endian machine");

class ByteWriter {
 public:
  template <typename T>
  void put(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void varint(uint64_t value) {
    for (; value >= 0x80; value >>= 7U) bytes_ += static_cast<char>(value | 0x80U);
    bytes_ += static_cast<char>(value);
  }
  /// Writes the length of `text` as a varint, then its bytes.
  void text(std::string_view text) {
    varint(text.size());
    bytes_ += text;
  }
  void raw(std::string_view bytes) { bytes_ += bytes; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class ByteReader {
 public:
  /// Reads from `bytes`, which must outlive the reader; `name` is the prefix of every error message.
  ByteReader(std::string_view bytes, const std::string& name) : rest_(bytes), name_(name) {}

  template <typename T>
  T get() {
    T value;
    std::memcpy(&value, raw(sizeof value).data(), sizeof value);
    return value;
  }
  uint64_t varint() {
    uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const auto byte = static_cast<unsigned char>(raw(1).front());
      const uint64_t bits = byte & 0x7FU;
      if (shift == 63 && bits > 1) break;
      value |= bits << shift;
      if (byte < 0x80) return value;
    }
    fail("{}: damaged: a number has more than 64 bits", name_);
  }
  /// Returns `n` after checking that the remaining bytes suffice for `n` items of at least `size` bytes each;
  /// otherwise throws Error.
  size_t checked_count(uint64_t n, size_t size) const {
    if (n > rest_.size() / size) damaged();
    return static_cast<size_t>(n);
  }
  /// Reads a count as a varint; see checked_count().
  size_t count(size_t size) { return checked_count(varint(), size); }
  std::string_view text() { return raw(count(1)); }
  std::string_view raw(size_t n) {
    if (n > rest_.size()) damaged();
    const std::string_view piece = rest_.substr(0, n);
    rest_.remove_prefix(n);
    return piece;
  }
  std::string_view rest() const { return rest_; }
  bool at_end() const { return rest_.empty(); }
  void expect_end() const {
    if (!rest_.empty()) damaged();
  }
  [[noreturn]] void damaged() const { fail("{}: damaged: its length does not fit its content", name_); }

 private:
  std::string_view rest_;
  const std::string& name_;
};

}  // namespace sextant
