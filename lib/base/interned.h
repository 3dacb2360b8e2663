#pragma once

// An interned string, for texts that occur often, such as the name of a number in every record: each distinct
// text is stored once for the life of the program, and an Interned has the size of a pointer. Equality
// compares pointers; the order is that of the texts. Safe to use from several threads.

#include <fmt/format.h>

#include <ostream>
#include <string>
#include <string_view>

namespace sextant {

class Interned {
 public:
  Interned();
  Interned(std::string_view text);
  Interned(const std::string& text) : Interned(std::string_view(text)) {}
  Interned(const char* text) : Interned(std::string_view(text)) {}

  const std::string& str() const { return *text_; }
  operator const std::string&() const { return *text_; }
  bool empty() const { return text_->empty(); }

  friend bool operator==(Interned a, Interned b) { return a.text_ == b.text_; }
  friend bool operator==(Interned a, const std::string& b) { return *a.text_ == b; }
  friend bool operator==(Interned a, const char* b) { return *a.text_ == b; }
  friend bool operator<(Interned a, Interned b) { return a.text_ != b.text_ && *a.text_ < *b.text_; }
  friend std::ostream& operator<<(std::ostream& out, Interned a) { return out << *a.text_; }

 private:
  const std::string* text_;
};

}  // namespace sextant

template <>
struct fmt::formatter<sextant::Interned> : fmt::formatter<std::string_view> {
  template <typename Context>
  auto format(sextant::Interned text, Context& context) const {
    return fmt::formatter<std::string_view>::format(text.str(), context);
  }
};
