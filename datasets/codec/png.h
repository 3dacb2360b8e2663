#pragma once

// PNG images (ISO/IEC 15948): decoding and encoding from and to memory.
//
// Read: 1/2/4/8-bit gray, palette, 8-bit gray + alpha, RGB and RGBA (only decode_png_rgba() keeps alpha),
// 16-bit gray and RGB. Not read: interlaced files, 16-bit with alpha.
//
// Every decoder takes the bytes of one file and its name for messages. It throws Error if the file is not a
// PNG, is truncated, has a chunk with a wrong CRC-32 or data with a wrong Adler-32, or contains pixels of
// another kind than the decoder expects. A damaged file is never decoded in part. Safe to call from several
// threads.

#include <string>
#include <string_view>

#include "sextant/measurement/image.h"

namespace sextant {

struct Rgb16 {
  uint16_t r = 0;
  uint16_t g = 0;
  uint16_t b = 0;
  bool operator==(const Rgb16&) const = default;
};

struct Rgba {
  uint8_t r = 0;
  uint8_t g = 0;
  uint8_t b = 0;
  uint8_t a = 0;
  bool operator==(const Rgba&) const = default;
};

struct PngHeader {
  int width = 0;       ///< px
  int height = 0;      ///< px
  int bit_depth = 0;   ///< per channel or palette index: 1, 2, 4, 8, 16
  int color_type = 0;  ///< 0 gray, 2 RGB, 3 palette, 4 gray + alpha, 6 RGBA
  bool interlaced = false;
};

/// Returns size and kind of pixels from the header. `bytes` is the whole file: a header that declares more
/// pixels than the file can contain is an Error.
PngHeader png_header(std::string_view bytes, const std::string& name);

/// Decodes 16-bit gray (depth, disparity, instance ids).
Image<uint16_t> decode_png16(std::string_view bytes, const std::string& name);
/// Decodes 16-bit RGB (flow).
Image<Rgb16> decode_png_rgb16(std::string_view bytes, const std::string& name);
/// Decodes 8-bit RGBA, with the four bytes of each pixel unchanged.
Image<Rgba> decode_png_rgba(std::string_view bytes, const std::string& name);
/// Decodes up to 8 bits as colour, without alpha: palettes are looked up, gray is repeated.
Image<Rgb> decode_png_rgb(std::string_view bytes, const std::string& name);
/// Decodes up to 8 bits as luminance, without alpha: gray unchanged (1/2/4 bits scaled to 0..255), colour
/// through rgb_to_gray().
Image<uint8_t> decode_png_gray(std::string_view bytes, const std::string& name);
/// Decodes the stored numbers of a palette or gray image of up to 16 bits, without looking them up (label
/// images).
Image<uint16_t> decode_png_ids(std::string_view bytes, const std::string& name);

/// Returns the BT.601 luminance (9798 R + 19235 G + 3735 B + 2^14) >> 15, the same integers as OpenCV's
/// COLOR_RGB2GRAY.
Image<uint8_t> rgb_to_gray(const Image<Rgb>& image);

struct PngEncoding {
  int level = 6;    ///< deflate level, 1 fastest .. 12 smallest
  int filter = -1;  ///< 0 none, 1 sub, 2 up, 3 average, 4 Paeth; -1: per row, smallest sum of magnitudes
};

std::string encode_png(const Image<uint8_t>& image, const PngEncoding& encoding = {});
std::string encode_png(const Image<uint16_t>& image, const PngEncoding& encoding = {});
std::string encode_png(const Image<Rgb>& image, const PngEncoding& encoding = {});
std::string encode_png(const Image<Rgb16>& image, const PngEncoding& encoding = {});
std::string encode_png(const Image<Rgba>& image, const PngEncoding& encoding = {});

}  // namespace sextant
