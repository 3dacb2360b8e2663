#include "sextant/datasets/codec/mask_text.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace sextant {
namespace {

static_assert(std::endian::native == std::endian::little, "four_labels stores its lanes in memory order");

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Four labels of one digit, each followed by a blank ("0 0 1 1 "), at once: xor leaves the digit in the low
// byte of each 16-bit lane and 0 in the high byte, that is the four pixels themselves.
bool four_labels(const char* p, uint64_t& lanes) {
  uint64_t word;
  std::memcpy(&word, p, sizeof word);
  lanes = word ^ 0x2030203020302030u;
  return (lanes & 0xfff0fff0fff0fff0u) == 0 && ((lanes + 0x0006000600060006u) & 0x0010001000100010u) == 0;
}

class MaskParser {
 public:
  MaskParser(std::string_view text, const std::string& name)
      : name_(name), at_(text.data()), end_(at_ + text.size()) {
    line_start_ = at_;
  }

  // Parses one line into out[0..capacity) and steps over its end. Returns how many numbers the line has,
  // which may be more than capacity.
  size_t row(uint16_t* out, size_t capacity) {
    ++line_;
    line_start_ = at_;
    size_t n = 0;
    while (true) {
      uint64_t lanes;
      while (end_ - at_ >= 8 && n + 4 <= capacity && four_labels(at_, lanes)) {
        std::memcpy(out + n, &lanes, sizeof lanes);
        at_ += 8;
        n += 4;
      }
      while (at_ != end_ && is_blank(*at_)) ++at_;
      if (at_ == end_) return n;
      if (*at_ == '\n') {
        ++at_;
        return n;
      }
      const uint16_t label = number();
      if (n < capacity) out[n] = label;
      ++n;
    }
  }

  int line() const { return line_; }

 private:
  uint16_t number() {
    const char* start = at_;
    uint32_t value = 0;
    while (at_ != end_ && is_digit(*at_) && value <= 65535)
      value = 10 * value + static_cast<uint32_t>(*at_++ - '0');
    const bool ended = at_ == end_ || is_blank(*at_) || *at_ == '\n';
    if (at_ == start || !ended || value > 65535) bad_number(start);
    return static_cast<uint16_t>(value);
  }

  [[noreturn]] void bad_number(const char* start) const {
    const char* stop = start;
    while (stop != end_ && !is_blank(*stop) && *stop != '\n' && stop - start < 20) ++stop;
    fail("{}:{}:{}: expected an instance id 0..65535, got '{}'", name_, line_, start - line_start_ + 1,
         std::string_view(start, static_cast<size_t>(stop - start)));
  }

  const std::string& name_;
  const char* at_;
  const char* end_;
  const char* line_start_;
  int line_ = 0;
};

}  // namespace

Image<uint16_t> decode_mask_text(std::string_view text, const std::string& name) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  while (!text.empty() && (is_blank(text.back()) || text.back() == '\n')) text.remove_suffix(1);
  if (text.empty()) fail("{}: expected rows of instance ids, the file is empty", name);

  const size_t width = MaskParser(text, name).row(nullptr, 0);
  if (width == 0) fail("{}:1:1: expected a row of instance ids, got an empty line", name);
  const size_t height = static_cast<size_t>(std::ranges::count(text, '\n')) + 1;
  MaskParser parser(text, name);
  const auto read_row = [&](uint16_t* out, size_t capacity) {
    const size_t n = parser.row(out, capacity);
    if (n != width) {
      const size_t column = n < width ? n + 1 : width + 1;
      fail(
          "{}:{}: row has {} instance ids, the first row has "
          "{} (see value {}): every row needs the same number",
          name, parser.line(), n, width, column);
    }
  };
  // A label takes two bytes with its separator: with fewer, some row is short, and no memory is reserved for the image.
  if (width * height > (text.size() + 1) / 2) {
    for (size_t y = 0; y < height; ++y) read_row(nullptr, 0);
  }
  Image<uint16_t> mask(static_cast<int>(width), static_cast<int>(height));
  for (int y = 0; y < mask.height(); ++y) read_row(mask.row(y), width);
  return mask;
}

std::string encode_mask_text(const Image<uint16_t>& mask) {
  std::string out;
  out.reserve(2 * mask.size() + static_cast<size_t>(mask.height()));
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      const uint16_t label = mask(x, y);
      label < 10 ? out.push_back(static_cast<char>('0' + label))
                 : static_cast<void>(out += std::to_string(label));
      out.push_back(' ');
    }
    out.push_back('\n');
  }
  return out;
}

}  // namespace sextant
