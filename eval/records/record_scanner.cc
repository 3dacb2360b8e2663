#include "sextant/eval/records/record_stream.h"

#include <charconv>
#include <cmath>

#include "sextant/eval/records/record_fields.h"

namespace sextant {
namespace internal {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The rest of a line; the first thing that does not fit makes it `bad` for good.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  bool good() const { return good_; }
  bool finished() const { return good_ && text_.empty(); }

  void literal(std::string_view expected) {
    if (!accept(expected)) good_ = false;
  }

  bool accept(std::string_view expected) {
    if (!good_ || !text_.starts_with(expected)) return false;
    text_.remove_prefix(expected.size());
    return true;
  }

  /// Whether ,"name": comes next.
  template <size_t N>
  bool has_name(const char (&name)[N]) const {
    constexpr size_t n = N - 1;
    return good_ && text_.size() > n + 3 && text_[0] == ',' && text_[1] == '"' &&
           text_.substr(2, n) == name && text_[n + 2] == '"' && text_[n + 3] == ':';
  }
  template <size_t N>
  bool accept_name(const char (&name)[N]) {
    if (!has_name(name)) return false;
    text_.remove_prefix(N + 3);
    return true;
  }

  /// Between quotes, without escapes.
  std::string_view text() {
    literal("\"");
    // Escapes, control characters and what is not ASCII are the general parser's business.
    const auto plain = [](char c) { return c >= 0x20 && c < 0x7f && c != '"' && c != '\\'; };
    size_t end = 0;
    while (end < text_.size() && plain(text_[end])) ++end;
    if (!good_ || end == text_.size() || text_[end] != '"') return fail_with<std::string_view>();
    const std::string_view found = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    return found;
  }

  template <typename T>
  T number() {
    if (!good_) return T{};
    const size_t sign = text_.starts_with('-') ? 1 : 0;
    const auto digit_at = [&](size_t i) { return i < text_.size() && is_digit(text_[i]); };
    if (!digit_at(sign) || (text_[sign] == '0' && digit_at(sign + 1))) return fail_with<T>();
    T value{};
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    if (error != std::errc() || !is_digit(end[-1])) return fail_with<T>();
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(value)) return fail_with<T>();
    }
    text_.remove_prefix(static_cast<size_t>(end - text_.data()));
    return value;
  }

  /// {"key":1.5,...}, keys rising.
  void numbers(std::string_view name, Record::Numbers& numbers) {
    numbers.clear();
    literal("{");
    if (accept("}")) return;
    do {
      const Interned key = text();
      literal(":");
      const auto value = number<double>();
      if (!good_ || !is_number_of(name, key, value) || !numbers.append(key, value)) return fail_with();
    } while (accept(","));
    literal("}");
  }

  template <typename T = void>
  T fail_with() {
    good_ = false;
    return T();
  }

 private:
  std::string_view text_;
  bool good_ = true;
};

/// Each field in its place: ,"name":value.
class FieldScanner : public Scanner {
 public:
  using Scanner::Scanner;

  template <size_t N, typename T>
  void field(const char (&name)[N], T& value) {
    if (!accept_name(name)) fail_with();
    if constexpr (std::is_enum_v<T>) {
      if (good() && from_text(text(), value) != nullptr) fail_with();
    } else if constexpr (std::is_same_v<T, Record::Numbers>) {
      numbers(name, value);
    } else if constexpr (std::is_same_v<T, Interned>) {
      value = text();
    } else {
      value = number<T>();
    }
  }

  template <size_t N, typename T, typename Value>
  void field(const char (&name)[N], T& value, const FieldRule<Value>& rule) {
    field(name, value);
    if (!rule.allows(value)) fail_with();
  }

  template <size_t N, typename T>
  void only_if(bool is_there, const char (&name)[N], T& value, const char*) {
    if (is_there) field(name, value);  // where it is not, the next field does not fit
  }

  template <size_t N>
  void unless_empty(const char (&name)[N], Interned& value, const FieldRule<std::string_view>& rule) {
    if (has_name(name)) field(name, value, rule);
  }
};

}  // namespace
}  // namespace internal

bool scan_record(std::string_view text, Record& record) {
  internal::FieldScanner line(text);
  line.literal(R"({"schema":)");
  if (line.number<int>() != internal::record_schema) return false;
  record.gate = Gate::none;
  record.flow_truth = {};
  internal::visit_fields(record, line);
  line.literal("}");
  return line.finished();
}

}  // namespace sextant
