#include "sextant/eval/records/record_stream.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

constexpr size_t block_bytes = size_t{4} << 20U;
static_assert(block_bytes > max_record_bytes);

/// Passes the record of each line to a visitor; error messages name the line.
class LineReader {
 public:
  LineReader(std::string name, const RecordVisitor& visit) : name_(std::move(name)), visit_(visit) {}

  /// Visits the complete lines; returns the rest.
  std::string_view read_lines(std::string_view text) {
    while (!text.empty()) {
      const void* end = std::memchr(text.data(), '\n', text.size());
      const size_t size =
          end == nullptr ? text.size() : static_cast<size_t>(static_cast<const char*>(end) - text.data());
      if (size > max_record_bytes)
        fail("{}: the line has more than {} bytes: expected a record", where(), max_record_bytes);
      if (end == nullptr) break;
      read_line(text.substr(0, size));
      text.remove_prefix(size + 1);
    }
    return text;
  }

  void expect_end(std::string_view rest) const {
    if (rest.empty()) return;
    fail("{}: the line is not finished: the file is truncated; repeat the run that wrote it", where());
  }

 private:
  /// Returns the position of the line that is read next.
  std::string where() const { return fmt::format("{}:{}", name_, n_lines_ + 1); }

  void read_line(std::string_view line) {
    if (!scan_record(line, record_))
      record_ = record_from_json(parse_json(line, name_, n_lines_ + 1), where());
    ++n_lines_;
    visit_(record_);
  }

  std::string name_;
  const RecordVisitor& visit_;
  int n_lines_ = 0;
  Record record_;
};

}  // namespace

std::string write_records(const std::vector<Record>& records) {
  std::string text;
  for (const Record& record : records) {
    text += json_line(to_json(record));
    text += '\n';
  }
  return text;
}

std::vector<Record> parse_records(std::string_view text, const std::string& name) {
  std::vector<Record> records;
  records.reserve(static_cast<size_t>(std::ranges::count(text, '\n')));
  for_each_record(text, name, [&](Record& record) { records.push_back(record); });
  return records;
}

std::vector<Record> read_records(const std::filesystem::path& path) {
  std::vector<Record> records;
  for_each_record(path, [&](Record& record) { records.push_back(record); });
  return records;
}

void for_each_record(std::string_view text, const std::string& name, const RecordVisitor& visit) {
  LineReader lines(name, visit);
  lines.expect_end(lines.read_lines(text));
}

void for_each_record(const std::filesystem::path& path, const RecordVisitor& visit) {
  check_keeps_records(path);
  const FileReader file(path, streamed_file);
  LineReader lines(path.string(), visit);
  std::vector<char> block(block_bytes);
  size_t kept = 0;  // length of the incomplete line kept from the last block
  for (uint64_t at = 0;;) {
    const size_t n = file.read(block.data() + kept, block.size() - kept, at);
    const std::string_view rest = lines.read_lines({block.data(), kept + n});
    if (n == 0) return lines.expect_end(rest);
    at += n;
    kept = rest.size();
    std::memmove(block.data(), rest.data(), kept);
  }
}

namespace internal {
namespace {

/// Scans the rest of a line; the first mismatch makes it `bad` permanently.
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

  /// Returns true if ,"name": comes next.
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

  /// Scans a text between quotes without escapes.
  std::string_view text() {
    literal("\"");
    // Escapes, control characters and non-ASCII characters are left to the general parser.
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

  /// Scans {"key":1.5,...} with ascending keys.
  void numbers(std::string_view name, Record::Numbers& numbers) {
    numbers.clear();
    literal("{");
    if (accept("}")) return;
    do {
      const Interned key = text();
      literal(":");
      const auto value = number<double>();
      if (!good_ || !is_number_of(name, value) || !numbers.append(key, value)) return fail_with();
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

/// Scans each field in its place: ,"name":value.
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
    if (is_there) field(name, value);  // if it is absent, the next field does not match
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
