#include "sextant/datasets/codec/png.h"

#include <libdeflate.h>
#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "sextant/datasets/codec/image_claim.h"
#include "sextant/datasets/codec/png_filter.h"

namespace sextant {
namespace {

constexpr std::string_view signature("\x89PNG\r\n\x1a\n", 8);
constexpr size_t header_end = 33;           // signature + IHDR chunk
constexpr size_t max_deflate_ratio = 1032;  // the highest ratio of deflate

constexpr int gray_kind = 0, rgb = 2, palette_kind = 3, gray_alpha = 4, rgb_alpha = 6;

uint32_t big_endian32(const char* p) {
  uint32_t x;
  std::memcpy(&x, p, 4);
  return std::endian::native == std::endian::little ? __builtin_bswap32(x) : x;
}

[[noreturn]] void truncated(const std::string& name, size_t n_bytes) {
  fail("{}: PNG file is truncated after {} bytes: copy or download it again", name, n_bytes);
}

int n_channels(int color_type) {
  return color_type == rgb ? 3 : color_type == gray_alpha ? 2 : color_type == rgb_alpha ? 4 : 1;
}

size_t bits_per_pixel(const PngHeader& h) {
  return static_cast<size_t>(h.bit_depth) * static_cast<size_t>(n_channels(h.color_type));
}

/// Returns the bytes of a row without its filter byte.
size_t row_bytes(const PngHeader& h) { return (static_cast<size_t>(h.width) * bits_per_pixel(h) + 7) / 8; }

/// Returns the bytes of all rows including their filter bytes.
size_t raw_bytes(const PngHeader& h) { return (row_bytes(h) + 1) * static_cast<size_t>(h.height); }

/// Throws Error if the file is too short for the pixels of its header.
void check_claim(const PngHeader& h, const std::string& name, size_t file_bytes, size_t pixel_bytes) {
  const auto width = static_cast<uint64_t>(h.width), height = static_cast<uint64_t>(h.height);
  check_image_claim("PNG", name, width, height, raw_bytes(h) + pixel_bytes * width * height, file_bytes);
  if (raw_bytes(h) / max_deflate_ratio > file_bytes) {
    fail(
        "{}: PNG file of {} bytes is too short for the {}x{} pixels that its header claims: copy or "
        "download it again",
        name, file_bytes, width, height);
  }
}

std::string describe(const PngHeader& header) {
  const char* kind = header.color_type == gray_kind      ? "gray"
                     : header.color_type == rgb          ? "RGB"
                     : header.color_type == palette_kind ? "palette"
                     : header.color_type == gray_alpha   ? "gray + alpha"
                                                         : "RGBA";
  return fmt::format("{}-bit {}", header.bit_depth, kind);
}

bool known_kind(const PngHeader& h) {
  const int d = h.bit_depth;
  if (h.color_type == gray_kind) return d == 1 || d == 2 || d == 4 || d == 8 || d == 16;
  if (h.color_type == palette_kind) return d == 1 || d == 2 || d == 4 || d == 8;
  return (h.color_type == rgb || h.color_type == gray_alpha || h.color_type == rgb_alpha) &&
         (d == 8 || d == 16);
}

using Palette = std::array<Rgb, 256>;

// The compressed pixels, and the chunks needed to interpret them.
struct Chunks {
  PngHeader header;
  Palette palette{};
  std::string_view first;  // the first IDAT chunk, as a view of the file
  std::string joined;      // all IDAT chunks, if there are several

  std::string_view data() const { return joined.empty() ? first : joined; }
};

void read_palette(std::string_view body, const std::string& name, Palette& palette) {
  if (body.size() % 3 != 0 || body.size() > 3 * 256) {
    fail("{}: its PNG palette has {} bytes, expected a multiple of 3, 768 at most: copy or download it again",
         name, body.size());
  }
  for (size_t i = 0; i < body.size() / 3; ++i) {
    palette[i] = {static_cast<uint8_t>(body[3 * i]), static_cast<uint8_t>(body[3 * i + 1]),
                  static_cast<uint8_t>(body[3 * i + 2])};
  }
}

void read_chunks(std::string_view bytes, const std::string& name, Chunks& out) {
  out.header = png_header(bytes, name);
  bool has_palette = false;
  size_t n_data = 0;
  size_t at = signature.size();
  for (std::string_view type; type != "IEND";) {
    if (bytes.size() - at < 12) truncated(name, bytes.size());
    const size_t length = big_endian32(bytes.data() + at);
    if (bytes.size() - at - 12 < length) truncated(name, bytes.size());
    type = bytes.substr(at + 4, 4);
    const std::string_view body = bytes.substr(at + 8, length);
    if (libdeflate_crc32(0, type.data(), 4 + length) != big_endian32(body.data() + length)) {
      fail("{}: PNG chunk at byte {} is damaged (its CRC-32 is wrong): copy or download the file again", name,
           at);
    }
    if (type == "IDAT") {
      if (++n_data == 1) {
        out.first = body;
      } else {
        if (n_data == 2) {
          out.joined.reserve(bytes.size());
          out.joined = out.first;
        }
        out.joined += body;
      }
    } else if (type == "PLTE") {
      read_palette(body, name, out.palette);
      has_palette = true;
    } else if (type != "IHDR" && type != "IEND" && (type[0] & 0x20) == 0) {
      fail("{}: PNG has an unknown critical chunk at byte {}: convert it to a plain PNG", name, at);
    }
    at += 12 + length;
  }
  if (n_data == 0) fail("{}: PNG has no pixels (no IDAT chunk): copy or download it again", name);
  if (out.header.color_type == palette_kind && !has_palette)
    fail("{}: palette PNG has no palette (no PLTE chunk): copy or download it again", name);
}

struct FreeDecompressor {
  void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
};

// Inflates all rows, each with its filter byte and still filtered.
void inflate(std::string_view data, const std::string& name, uint8_t* raw, size_t n_raw) {
  thread_local const std::unique_ptr<libdeflate_decompressor, FreeDecompressor> decompressor(
      libdeflate_alloc_decompressor());
  SEXTANT_CHECK(decompressor != nullptr);
  size_t n = 0;
  const auto result =
      libdeflate_zlib_decompress(decompressor.get(), data.data(), data.size(), raw, n_raw, &n);
  if (result == LIBDEFLATE_INSUFFICIENT_SPACE) {
    fail("{}: PNG holds more pixels than its header says: copy or download it again", name);
  }
  if (result != LIBDEFLATE_SUCCESS) {
    fail("{}: PNG pixels are damaged (inflate failed): copy or download the file again", name);
  }
  if (n != n_raw)
    fail("{}: PNG holds {} bytes of pixels, its header says {}: copy or download it again", name, n, n_raw);
}

// The inflated, still filtered rows of a file.
class RawRows {
 public:
  RawRows(const Chunks& chunks, const std::string& name) : header_(chunks.header), name_(name) {
    if (header_.interlaced) {
      fail("{}: interlaced PNG is not read: save it without interlacing (mogrify -interlace none FILE)",
           name);
    }
    const size_t n_raw = raw_bytes(header_);
    raw_ = std::make_unique_for_overwrite<uint8_t[]>(n_raw + internal::png_row_slack);
    inflate(chunks.data(), name, raw_.get(), n_raw);
  }

  // Calls consume(y, row) for every row in order, with the row's unfiltered bytes.
  template <typename Consume>
  void for_each(Consume consume) {
    const size_t n_row = row_bytes(header_), bits = bits_per_pixel(header_);
    const int bytes_per_pixel = bits < 8 ? 1 : static_cast<int>(bits / 8);
    const uint8_t* prior = nullptr;
    for (int y = 0; y < header_.height; ++y) {
      uint8_t* row = raw_.get() + static_cast<size_t>(y) * (n_row + 1);
      if (!internal::png_unfilter(row[0], row + 1, prior, n_row, bytes_per_pixel)) {
        fail("{}: PNG row {} has filter type {}, expected 0 to 4: copy or download the file again", name_, y,
             row[0]);
      }
      consume(y, row + 1);
      prior = row + 1;
    }
  }

 private:
  const PngHeader header_;
  const std::string& name_;
  std::unique_ptr<uint8_t[]> raw_;
};

template <typename T>
Chunks open(std::string_view bytes, const std::string& name, bool (*accept)(const PngHeader&),
            const char* expected) {
  Chunks chunks;
  const PngHeader header = png_header(bytes, name);
  if (!accept(header)) fail("{}: expected a PNG of {}, got {}", name, expected, describe(header));
  check_claim(header, name, bytes.size(), sizeof(T));
  read_chunks(bytes, name, chunks);
  return chunks;
}

uint16_t big_endian16(const uint8_t* p) { return static_cast<uint16_t>((p[0] << 8) | p[1]); }

// Returns the index at column x of a row with 1, 2, 4 or 8 bits per pixel.
uint8_t index_at(const uint8_t* row, int x, int bit_depth) {
  if (bit_depth == 8) return row[x];
  const int per_byte = 8 / bit_depth;
  const int shift = 8 - bit_depth * (x % per_byte + 1);
  return static_cast<uint8_t>((row[x / per_byte] >> shift) & ((1 << bit_depth) - 1));
}

uint8_t luminance(int r, int g, int b) {
  return static_cast<uint8_t>((9798 * r + 19235 * g + 3735 * b + (1 << 14)) >> 15);
}

bool is_8bit(const PngHeader& h) { return h.bit_depth <= 8; }

}  // namespace

PngHeader png_header(std::string_view bytes, const std::string& name) {
  const std::string_view start = bytes.substr(0, signature.size());
  if (bytes.empty()) fail("{}: expected a PNG image, the file is empty", name);
  if (start != signature.substr(0, start.size()))
    fail("{}: not a PNG image (its signature is missing)", name);
  if (bytes.size() < header_end) truncated(name, bytes.size());
  if (bytes.substr(12, 4) != "IHDR" || big_endian32(bytes.data() + 8) != 13) {
    fail("{}: PNG does not start with its header (IHDR): copy or download it again", name);
  }
  if (libdeflate_crc32(0, bytes.data() + 12, 17) != big_endian32(bytes.data() + 29)) {
    fail("{}: PNG header is damaged (its CRC-32 is wrong): copy or download the file again", name);
  }
  const uint32_t width = big_endian32(bytes.data() + 16);
  const uint32_t height = big_endian32(bytes.data() + 20);
  if (width == 0 || height == 0 || width > 1'000'000 || height > 1'000'000) {
    fail("{}: its PNG header names {}x{} pixels, expected 1 to 1000000 each: the file is damaged", name,
         width, height);
  }
  PngHeader header{.width = static_cast<int>(width), .height = static_cast<int>(height)};
  header.bit_depth = static_cast<uint8_t>(bytes[24]);
  header.color_type = static_cast<uint8_t>(bytes[25]);
  header.interlaced = bytes[28] != 0;
  if (!known_kind(header)) {
    fail(
        "{}: PNG header names bit depth {} and colour type {}, which PNG does not combine: the file is "
        "damaged",
        name, header.bit_depth, header.color_type);
  }
  check_claim(header, name, bytes.size(), 0);
  return header;
}

Image<uint16_t> decode_png16(std::string_view bytes, const std::string& name) {
  Chunks chunks = open<uint16_t>(
      bytes, name, [](const PngHeader& h) { return h.bit_depth == 16 && h.color_type == gray_kind; },
      "16-bit gray");
  RawRows rows(chunks, name);
  Image<uint16_t> image(chunks.header.width, chunks.header.height);
  rows.for_each([&](int y, const uint8_t* row) {
    uint16_t* out = image.row(y);
    for (int x = 0; x < image.width(); ++x) out[x] = big_endian16(row + 2 * x);
  });
  return image;
}

Image<Rgb16> decode_png_rgb16(std::string_view bytes, const std::string& name) {
  Chunks chunks = open<Rgb16>(
      bytes, name, [](const PngHeader& h) { return h.bit_depth == 16 && h.color_type == rgb; }, "16-bit RGB");
  RawRows rows(chunks, name);
  Image<Rgb16> image(chunks.header.width, chunks.header.height);
  rows.for_each([&](int y, const uint8_t* row) {
    static_assert(sizeof(Rgb16) == 6);
    uint16_t* out = &image.row(y)->r;
    for (int i = 0; i < 3 * image.width(); ++i) out[i] = big_endian16(row + 2 * i);
  });
  return image;
}

Image<Rgba> decode_png_rgba(std::string_view bytes, const std::string& name) {
  Chunks chunks = open<Rgba>(
      bytes, name, [](const PngHeader& h) { return h.bit_depth == 8 && h.color_type == rgb_alpha; },
      "8-bit RGBA");
  RawRows rows(chunks, name);
  Image<Rgba> image(chunks.header.width, chunks.header.height);
  rows.for_each([&](int y, const uint8_t* row) {
    static_assert(sizeof(Rgba) == 4);
    std::memcpy(image.row(y), row, 4 * static_cast<size_t>(image.width()));
  });
  return image;
}

Image<Rgb> decode_png_rgb(std::string_view bytes, const std::string& name) {
  Chunks chunks = open<Rgb>(bytes, name, is_8bit, "up to 8 bit per channel");
  const int depth = chunks.header.bit_depth;
  const int type = chunks.header.color_type;
  RawRows rows(chunks, name);
  Image<Rgb> image(chunks.header.width, chunks.header.height);
  rows.for_each([&](int y, const uint8_t* row) {
    Rgb* out = image.row(y);
    const int w = image.width();
    static_assert(sizeof(Rgb) == 3);
    if (type == rgb) {
      std::memcpy(out, row, 3 * static_cast<size_t>(w));
    } else if (type == rgb_alpha) {
      for (int x = 0; x < w; ++x) out[x] = {row[4 * x], row[4 * x + 1], row[4 * x + 2]};
    } else if (type == palette_kind) {
      for (int x = 0; x < w; ++x) out[x] = chunks.palette[index_at(row, x, depth)];
    } else {
      const int stride = n_channels(type);
      const int stretch = 255 / ((1 << depth) - 1);
      for (int x = 0; x < w; ++x) {
        const auto gray = static_cast<uint8_t>(stretch * index_at(row, stride * x, depth));
        out[x] = {gray, gray, gray};
      }
    }
  });
  return image;
}

Image<uint8_t> decode_png_gray(std::string_view bytes, const std::string& name) {
  Chunks chunks = open<uint8_t>(bytes, name, is_8bit, "up to 8 bit per channel");
  const int depth = chunks.header.bit_depth;
  const int type = chunks.header.color_type;
  const int stride = n_channels(type);
  RawRows rows(chunks, name);
  Image<uint8_t> image(chunks.header.width, chunks.header.height);
  rows.for_each([&](int y, const uint8_t* row) {
    uint8_t* out = image.row(y);
    const int w = image.width();
    if (type == rgb) {
      for (int x = 0; x < w; ++x) out[x] = luminance(row[3 * x], row[3 * x + 1], row[3 * x + 2]);
    } else if (type == rgb_alpha) {
      for (int x = 0; x < w; ++x) out[x] = luminance(row[4 * x], row[4 * x + 1], row[4 * x + 2]);
    } else if (type == palette_kind) {
      for (int x = 0; x < w; ++x) {
        const Rgb c = chunks.palette[index_at(row, x, depth)];
        out[x] = luminance(c.r, c.g, c.b);
      }
    } else {
      const int stretch = 255 / ((1 << depth) - 1);
      for (int x = 0; x < w; ++x) out[x] = static_cast<uint8_t>(stretch * index_at(row, stride * x, depth));
    }
  });
  return image;
}

Image<uint16_t> decode_png_ids(std::string_view bytes, const std::string& name) {
  if (png_header(bytes, name).bit_depth == 16) return decode_png16(bytes, name);
  Chunks chunks = open<uint8_t>(
      bytes, name,
      [](const PngHeader& h) {
        return h.bit_depth <= 8 && (h.color_type == gray_kind || h.color_type == palette_kind);
      },
      "palette indices or 8-bit gray");
  RawRows rows(chunks, name);
  Image<uint16_t> image(chunks.header.width, chunks.header.height);
  rows.for_each([&](int y, const uint8_t* row) {
    for (int x = 0; x < image.width(); ++x) image(x, y) = index_at(row, x, chunks.header.bit_depth);
  });
  return image;
}

Image<uint8_t> rgb_to_gray(const Image<Rgb>& image) {
  Image<uint8_t> gray(image.width(), image.height());
  for (size_t i = 0; i < image.size(); ++i) {
    const Rgb c = image.data()[i];
    gray.data()[i] = luminance(c.r, c.g, c.b);
  }
  return gray;
}

namespace {

void append32(std::string& out, uint32_t x) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>(x >> shift));
}

void append_chunk(std::string& out, std::string_view type, std::string_view body) {
  append32(out, static_cast<uint32_t>(body.size()));
  const size_t start = out.size();
  out += type;
  out += body;
  append32(out, libdeflate_crc32(0, out.data() + start, out.size() - start));
}

long sum_of_magnitudes(const std::vector<uint8_t>& row) {
  long sum = 0;
  for (const uint8_t x : row) sum += std::abs(static_cast<int8_t>(x));
  return sum;
}

struct FreeCompressor {
  void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
};

std::string deflate(const std::string& raw, int level) {
  const std::unique_ptr<libdeflate_compressor, FreeCompressor> compressor(libdeflate_alloc_compressor(level));
  SEXTANT_CHECK(compressor != nullptr);
  std::string out(libdeflate_zlib_compress_bound(compressor.get(), raw.size()), '\0');
  out.resize(libdeflate_zlib_compress(compressor.get(), raw.data(), raw.size(), out.data(), out.size()));
  SEXTANT_CHECK(!out.empty());
  return out;
}

// Encodes `rows`: height rows of n_row bytes in PNG byte order.
std::string encode(const std::vector<uint8_t>& rows, int width, int height, int bit_depth, int color_type,
                   int bytes_per_pixel, const PngEncoding& encoding) {
  SEXTANT_CHECK(width > 0 && height > 0);
  SEXTANT_CHECK(encoding.filter >= -1 && encoding.filter <= 4);
  const size_t n_row = static_cast<size_t>(width) * static_cast<size_t>(bytes_per_pixel);
  std::string raw;
  raw.reserve((n_row + 1) * static_cast<size_t>(height));
  std::vector<uint8_t> best(n_row), trial(n_row);
  for (int y = 0; y < height; ++y) {
    const uint8_t* row = rows.data() + static_cast<size_t>(y) * n_row;
    const uint8_t* prior = y == 0 ? nullptr : row - n_row;
    int filter = std::max(0, encoding.filter);
    internal::png_filter(filter, row, prior, n_row, bytes_per_pixel, best.data());
    for (int f = 1; encoding.filter == -1 && f <= 4; ++f) {
      internal::png_filter(f, row, prior, n_row, bytes_per_pixel, trial.data());
      if (sum_of_magnitudes(trial) < sum_of_magnitudes(best)) {
        best.swap(trial);
        filter = f;
      }
    }
    raw.push_back(static_cast<char>(filter));
    raw.append(best.begin(), best.end());
  }

  std::string header;
  append32(header, static_cast<uint32_t>(width));
  append32(header, static_cast<uint32_t>(height));
  header.push_back(static_cast<char>(bit_depth));
  header.push_back(static_cast<char>(color_type));
  header.append(3, '\0');  // deflate, the five filters, not interlaced
  std::string out("\x89PNG\r\n\x1a\n", 8);
  append_chunk(out, "IHDR", header);
  append_chunk(out, "IDAT", deflate(raw, encoding.level));
  append_chunk(out, "IEND", "");
  return out;
}

std::vector<uint8_t> copy_bytes(const void* data, size_t n) {
  const auto* first = static_cast<const uint8_t*>(data);
  return {first, first + n};
}

std::vector<uint8_t> to_big_endian(const uint16_t* data, size_t n) {
  std::vector<uint8_t> out(2 * n);
  for (size_t i = 0; i < n; ++i) {
    out[2 * i] = static_cast<uint8_t>(data[i] >> 8);
    out[2 * i + 1] = static_cast<uint8_t>(data[i]);
  }
  return out;
}

}  // namespace

std::string encode_png(const Image<uint8_t>& image, const PngEncoding& encoding) {
  return encode(copy_bytes(image.data(), image.size()), image.width(), image.height(), 8, 0, 1, encoding);
}

std::string encode_png(const Image<uint16_t>& image, const PngEncoding& encoding) {
  return encode(to_big_endian(image.data(), image.size()), image.width(), image.height(), 16, 0, 2, encoding);
}

std::string encode_png(const Image<Rgb>& image, const PngEncoding& encoding) {
  return encode(copy_bytes(image.data(), 3 * image.size()), image.width(), image.height(), 8, 2, 3, encoding);
}

std::string encode_png(const Image<Rgb16>& image, const PngEncoding& encoding) {
  return encode(to_big_endian(image.empty() ? nullptr : &image.data()->r, 3 * image.size()), image.width(),
                image.height(), 16, 2, 6, encoding);
}

std::string encode_png(const Image<Rgba>& image, const PngEncoding& encoding) {
  return encode(copy_bytes(image.data(), 4 * image.size()), image.width(), image.height(), 8, 6, 4, encoding);
}

}  // namespace sextant
