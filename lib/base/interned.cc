#include "sextant/base/interned.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <unordered_set>

namespace sextant {
namespace {

struct TextHash {
  using is_transparent = void;
  size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
};

/// Returns the stored copy of a text, which all threads share. The set of texts is never destroyed, because
/// threads may read texts until the program ends.
const std::string* of_all_threads(std::string_view text) {
  static auto& mutex = *new std::mutex;
  static auto& texts = *new std::unordered_set<std::string, TextHash, std::equal_to<>>;
  const std::scoped_lock lock(mutex);
  const auto known = texts.find(text);
  return known != texts.end() ? &*known : &*texts.emplace(text).first;
}

const std::string& empty_text() {
  static const std::string& text = *of_all_threads("");
  return text;
}

/// Returns the place of a text in a thread's cache of 512 texts: a hash of its length and of its first and
/// last eight bytes, because names differ there.
size_t place_of(std::string_view text) {
  constexpr size_t n = sizeof(uint64_t);
  uint64_t first = 0, last = 0;
  if (text.size() >= n) {
    std::memcpy(&first, text.data(), n);
    std::memcpy(&last, text.data() + text.size() - n, n);
  } else if (!text.empty()) {  // memcpy() takes no null pointer, which an empty text may have
    std::memcpy(&first, text.data(), text.size());
  }
  const uint64_t mixed = (first ^ (last * 0x9E3779B97F4A7C15U) ^ text.size()) * 0xD6E8FEB86659FD93U;
  return mixed >> 55U;
}

}  // namespace

Interned::Interned() : text_(&empty_text()) {}

Interned::Interned(std::string_view text) {
  thread_local std::array<const std::string*, 512> recent{};
  const std::string*& known = recent[place_of(text)];
  if (known == nullptr || *known != text) known = of_all_threads(text);
  text_ = known;
}

}  // namespace sextant
