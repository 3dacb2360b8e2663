#include "sextant/datasets/codec/dense_maps.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "sextant/base/text.h"

namespace sextant {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

template <typename To, typename From, typename Map>
Image<To> map_pixels(const Image<From>& image, Map map) {
  Image<To> out(image.width(), image.height());
  for (size_t i = 0; i < image.size(); ++i) out.data()[i] = map(image.data()[i]);
  return out;
}

bool rounds_into(double x, double first, double last) {
  return std::round(x) >= first && std::round(x) <= last;
}

uint16_t rounded(double x) { return static_cast<uint16_t>(std::lround(x)); }

}  // namespace

Image<float> depth_from_disparity256(const Image<uint16_t>& disparity, double bf) {
  const double scale = 256.0 * bf;
  return map_pixels<float>(disparity, [scale](uint16_t n) {
    return n == 0 ? nan : static_cast<float>(scale / static_cast<double>(n));
  });
}

Image<float> depth_from_depth256(const Image<uint16_t>& depth) {
  return map_pixels<float>(depth, [](uint16_t n) { return n == 0 ? nan : static_cast<float>(n) / 256.0f; });
}

Image<float> depth_from_cm(const Image<uint16_t>& depth_cm) {
  return map_pixels<float>(depth_cm, [](uint16_t n) {
    return n == 0 || n == 65535 ? nan : static_cast<float>(static_cast<double>(n) / 100.0);
  });
}

Image<Flow> flow_from_kitti(const Image<Rgb16>& image) {
  return map_pixels<Flow>(image, [](Rgb16 p) {
    if (p.b == 0) return Flow{};
    return Flow{(static_cast<float>(p.r) - 32768.0f) / 64.0f, (static_cast<float>(p.g) - 32768.0f) / 64.0f};
  });
}

Image<Flow> flow_from_vkitti(const Image<Rgb16>& image) {
  const double w = image.width() - 1;
  const double h = image.height() - 1;
  return map_pixels<Flow>(image, [w, h](Rgb16 p) {
    if (p.b == 0) return Flow{};
    return Flow{static_cast<float>((2.0 * p.r / 65535.0 - 1.0) * w),
                static_cast<float>((2.0 * p.g / 65535.0 - 1.0) * h)};
  });
}

Image<uint16_t> disparity256_from_depth(const Image<float>& depth_m, double bf) {
  return map_pixels<uint16_t>(depth_m, [bf](float z) -> uint16_t {
    const double n = 256.0 * bf / z;
    return z > 0 && rounds_into(n, 1, 65535) ? rounded(n) : 0;
  });
}

Image<uint16_t> depth256_from_depth(const Image<float>& depth_m) {
  return map_pixels<uint16_t>(depth_m, [](float z) -> uint16_t {
    const double n = 256.0 * z;
    return rounds_into(n, 1, 65535) ? rounded(n) : 0;
  });
}

Image<uint16_t> cm_from_depth(const Image<float>& depth_m) {
  return map_pixels<uint16_t>(depth_m, [](float z) -> uint16_t {
    const double n = 100.0 * z;
    return rounds_into(n, 1, 65534) ? rounded(n) : 65535;
  });
}

Image<Rgb16> kitti_from_flow(const Image<Flow>& flow) {
  return map_pixels<Rgb16>(flow, [](Flow f) {
    const double r = 64.0 * f.u + 32768.0;
    const double g = 64.0 * f.v + 32768.0;
    if (!rounds_into(r, 0, 65535) || !rounds_into(g, 0, 65535)) return Rgb16{};
    return Rgb16{rounded(r), rounded(g), 1};
  });
}

Image<Rgb16> vkitti_from_flow(const Image<Flow>& flow) {
  const double w = flow.width() - 1;
  const double h = flow.height() - 1;
  return map_pixels<Rgb16>(flow, [w, h](Flow f) {
    const double r = (f.u / w + 1.0) / 2.0 * 65535.0;
    const double g = (f.v / h + 1.0) / 2.0 * 65535.0;
    if (!rounds_into(r, 0, 65535) || !rounds_into(g, 0, 65535)) return Rgb16{};
    return Rgb16{rounded(r), rounded(g), 65535};
  });
}

Image<float> depth_from_tartanair(const Image<Rgba>& image) {
  return image_of(image.width(), image.height(), [&](int x, int y) {
    const Rgba p = image(x, y);
    const float z =
        std::bit_cast<float>(uint32_t{p.b} | uint32_t{p.g} << 8 | uint32_t{p.r} << 16 | uint32_t{p.a} << 24);
    return z > 0 && z < tartanair_sky_m ? z : std::numeric_limits<float>::quiet_NaN();
  });
}

Image<Flow> flow_from_tartanair(const Image<Rgb16>& image) {
  return image_of(image.width(), image.height(), [&](int x, int y) {
    const Rgb16 p = image(x, y);
    if (p.r != 0) return Flow{};
    return Flow{(static_cast<float>(p.b) - 32768.0f) / 64.0f, (static_cast<float>(p.g) - 32768.0f) / 64.0f};
  });
}

namespace {

static_assert(std::endian::native == std::endian::little, ".flo files are copied to memory as they are");
static_assert(sizeof(Flow) == 8);

constexpr std::string_view magic = "PIEH";
constexpr size_t flo_header = 12;
constexpr float unknown_limit = 1e9f;
constexpr float unknown_value = 1e10f;

// Returns true if a pixel of the row is unknown. Bit patterns are compared as integers, which puts NaN and
// infinity above the largest known value, and without branches, which lets the loop vectorise: files without
// an unknown pixel, as networks write them, cost one pass at memory speed.
bool has_unknown(const Flow* row, size_t n) {
  const uint32_t largest = std::bit_cast<uint32_t>(unknown_limit) - 1;
  uint32_t above = 0;
  for (size_t i = 0; i < n; ++i) {
    const uint32_t u = std::bit_cast<uint32_t>(row[i].u) & 0x7fffffffu;
    const uint32_t v = std::bit_cast<uint32_t>(row[i].v) & 0x7fffffffu;
    above |= (largest - u) | (largest - v);
  }
  return (above >> 31) != 0;
}

}  // namespace

Image<Flow> decode_flo(std::string_view bytes, const std::string& name) {
  if (bytes.size() < flo_header) {
    fail("{}: expected a Middlebury .flo file, but it has only {} bytes", name, bytes.size());
  }
  if (bytes.substr(0, 4) != magic) {
    fail("{}: not a Middlebury .flo file: it does not start with the magic number 202021.25 (\"PIEH\")",
         name);
  }
  int32_t size[2];
  std::memcpy(size, bytes.data() + 4, sizeof size);
  const auto [width, height] = size;
  if (width <= 0 || height <= 0 || width > 1'000'000 || height > 1'000'000) {
    fail("{}: its .flo header names {}x{} pixels, expected 1 to 1000000 each: the file is damaged", name,
         width, height);
  }
  const size_t expected =
      flo_header + sizeof(Flow) * static_cast<size_t>(width) * static_cast<size_t>(height);
  if (bytes.size() != expected) {
    fail("{}: .flo file is {}: {} bytes instead of {} for its {}x{} pixels; make or copy it again", name,
         bytes.size() < expected ? "truncated" : "too long", bytes.size(), expected, width, height);
  }
  Image<Flow> flow(width, height);
  std::memcpy(flow.data(), bytes.data() + flo_header, expected - flo_header);
  const size_t n = static_cast<size_t>(width);
  for (int y = 0; y < height; ++y) {
    Flow* row = flow.row(y);
    if (!has_unknown(row, n)) continue;
    for (size_t x = 0; x < n; ++x) {
      if (!(std::abs(row[x].u) < unknown_limit && std::abs(row[x].v) < unknown_limit)) row[x] = Flow{};
    }
  }
  return flow;
}

std::string encode_flo(const Image<Flow>& flow) {
  std::string out(magic);
  const int32_t size[2] = {flow.width(), flow.height()};
  out.append(reinterpret_cast<const char*>(size), sizeof size);
  out.append(reinterpret_cast<const char*>(flow.data()), sizeof(Flow) * flow.size());
  for (size_t i = 0; i < flow.size(); ++i) {
    if (flow.data()[i].valid()) continue;
    const Flow unknown{unknown_value, unknown_value};
    std::memcpy(out.data() + flo_header + sizeof(Flow) * i, &unknown, sizeof unknown);
  }
  return out;
}

namespace {

static_assert(std::endian::native == std::endian::little, "four_ids stores its lanes in memory order");

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

// Parses four ids of one digit, each followed by a blank ("0 0 1 1 "), at once. A digit d and the blank are
// the bytes 0x3d 0x20; xor with 0x30 0x20 turns them into d 0, which is the pixel d as a little-endian
// uint16_t.
bool four_ids(const char* p, uint64_t& lanes) {
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

  // Parses one line into out[0..capacity) and advances past its end. Returns the number of values in the
  // line, which may exceed capacity.
  size_t row(uint16_t* out, size_t capacity) {
    ++line_;
    line_start_ = at_;
    size_t n = 0;
    while (true) {
      uint64_t lanes;
      while (end_ - at_ >= 8 && n + 4 <= capacity && four_ids(at_, lanes)) {
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
  // A label takes at least two bytes with its separator: if there are fewer bytes, some row is short, and
  // read_row() throws Error before memory for the image is allocated.
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
