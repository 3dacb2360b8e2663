#include <libdeflate.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/png_filter.h"

namespace sextant {
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

// `rows` holds height rows of n_row bytes in PNG byte order.
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
