#include "sextant/eval/logs/number_file.h"

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>

#include "sextant/base/files.h"
#include "sextant/eval/logs/trajectory_bytes.h"

namespace sextant {
namespace {

constexpr size_t kBlock = size_t{1} << 18;
constexpr size_t kLongestLine = size_t{1} << 16;
constexpr size_t kMostComments = 4096;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

bool begins_as_number(std::string_view text) {
  if (text.starts_with('+') || text.starts_with('-')) text.remove_prefix(1);
  const std::string_view word = text.substr(0, 3);
  return !text.empty() && ((text[0] >= '0' && text[0] <= '9') || text[0] == '.' || word == "nan" ||
                           word == "NaN" || word == "inf" || word == "Inf" || word == "NAN" || word == "INF");
}

std::string shown(std::string_view field) {
  return field.size() <= 40 ? std::string(field) : std::string(field.substr(0, 37)) + "...";
}

}  // namespace

void check_size(const std::string& path, uint64_t bytes, const ReadRules& rules) {
  if (bytes > rules.most_bytes) {
    fail("{}: has {} MB: a file of this kind may have {} MB at most", path, bytes / 1'000'000,
         rules.most_bytes / 1'000'000);
  }
}

NumberFile::NumberFile(std::string path, char separator, const ReadRules& rules)
    : path_(std::move(path)), separator_(separator), rules_(rules) {
  const OpenFile file = open_file(path_);
  file_ = file.descriptor;
  file_bytes_ = static_cast<size_t>(file.size);
  try {
    check_size(path_, file_bytes_, rules_);
  } catch (...) {
    ::close(file_);
    throw;
  }
  buffer_.resize(kBlock);
  if (refill() && std::string_view(buffer_.data(), end_).starts_with("\xef\xbb\xbf")) begin_ = 3;
  const std::string_view start(buffer_.data(), end_);
  if (start.starts_with("\xff\xfe") || start.starts_with("\xfe\xff")) {
    ::close(file_);
    fail("{}: is UTF-16 text; save it as UTF-8 or ASCII", path_);
  }
}

NumberFile::~NumberFile() { ::close(file_); }

bool NumberFile::refill() {
  if (at_end_) return false;
  if (file_bytes_ > data_file.max_bytes) {  // before the first block
    fail("{}: has {:.1f} GB, expected at most {:.2f} GB for {}", path_,
         static_cast<double>(file_bytes_) / 1e9, static_cast<double>(data_file.max_bytes) / 1e9,
         data_file.name);
  }
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (buffer_.size() - end_ < kBlock / 2) buffer_.resize(buffer_.size() + kBlock);
  ssize_t n = 0;
  do {
    n = ::read(file_, buffer_.data() + end_, buffer_.size() - end_);
  } while (n < 0 && errno == EINTR);
  if (n < 0) fail("{}: cannot read: {}", path_, std::strerror(errno));
  at_end_ = n == 0;
  end_ += static_cast<size_t>(n);
  return n > 0;
}

bool NumberFile::next_line(std::string_view& line) {
  for (;;) {
    const void* found = std::memchr(buffer_.data() + begin_, '\n', end_ - begin_);
    if (found == nullptr && at_end_ && begin_ < end_ && rules_.whole_lines) {
      is_cut_ = true;
      return false;
    }
    if (found != nullptr || (at_end_ && begin_ < end_)) {
      const size_t stop =
          found ? static_cast<size_t>(static_cast<const char*>(found) - buffer_.data()) : end_;
      line = {buffer_.data() + begin_, stop - begin_};
      begin_ = std::min(stop + 1, end_);
      ++line_;
      return true;
    }
    if (at_end_) return false;
    if (end_ - begin_ > kLongestLine) {
      ++line_;
      fail_here("a line of more than {} bytes: this is no text file of poses", kLongestLine);
    }
    refill();
  }
}

bool NumberFile::next() {
  std::string_view line;
  while (next_line(line)) {
    line = trim(line);
    if (line.empty()) continue;
    if (line.front() == '#') {
      if (comments_.size() + line.size() < kMostComments) comments_.append(line).push_back('\n');
      if (records_ == 0) last_comment_ = line.substr(0, kMostComments);
      continue;
    }
    if (records_ == 0 && header_.empty() && !begins_as_number(line)) {
      if (line.find('\0') != std::string_view::npos) fail_here("holds a zero byte: this is no text file");
      header_ = line.substr(0, kMostComments);
      continue;
    }
    line_bytes_ = line.size();
    if (separator_ == kEither) separator_ = line.find(',') != std::string_view::npos ? ',' : ' ';
    parse(line);
    ++records_;
    return true;
  }
  values_.clear();
  return false;
}

void NumberFile::parse(std::string_view line) {
  values_.clear();
  if (separator_ == ' ') {
    while (!line.empty()) {
      size_t stop = 0;
      while (stop < line.size() && !is_blank(line[stop])) ++stop;
      values_.push_back(parse_field(line.substr(0, stop)));
      while (stop < line.size() && is_blank(line[stop])) ++stop;
      line.remove_prefix(stop);
    }
    return;
  }
  if (line.back() == separator_) line.remove_suffix(1);  // some writers end each line with one
  for (;;) {
    const size_t stop = line.find(separator_);
    values_.push_back(parse_field(trim(line.substr(0, stop))));
    if (stop == std::string_view::npos) return;
    line.remove_prefix(stop + 1);
  }
}

double NumberFile::parse_field(std::string_view field) const {
  std::string_view text = field;
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = end == text.data() + text.size() && !text.empty();
  const size_t column = values_.size() + 1;
  if (whole && error == std::errc() && std::isfinite(value)) return value;
  if (whole && error == std::errc::result_out_of_range) {
    const size_t exponent = text.find_first_of("eE");
    if (exponent != std::string_view::npos && text.substr(exponent + 1).starts_with('-')) return 0;
    if (exponent == std::string_view::npos && text.find('.') != std::string_view::npos)
      return 0;  // 0.000...01
  }
  if (whole) {
    fail_here("value {} is '{}', which is no finite number: remove poses that were not estimated", column,
              shown(field));
  }
  if (text.empty()) fail_here("value {} is empty: a number was expected", column);
  if (text.find_first_of(", ") != std::string_view::npos) {
    fail_here(
        "expected a number for value {}, got '{}': write numbers with a decimal point and without thousands "
        "separators, and one separator between all of them: blanks or commas",
        column, shown(field));
  }
  fail_here("expected a number for value {}, got '{}'", column, shown(field));
}

}  // namespace sextant
