#pragma once

// JPEG images (8-bit gray or colour) through libjpeg. JPEG is lossy: what was encoded is not quite what is
// decoded, not even at quality 100.

#include <string>
#include <string_view>

#include "sextant/measurement/image.h"

namespace sextant {

/// Throws Error on bytes that are not a JPEG file, or one that is cut off or damaged. Orientation tags are
/// ignored.
Image<Rgb> decode_jpeg_rgb(std::string_view bytes, const std::string& name);

/// `quality` 1..100.
std::string encode_jpeg(const Image<Rgb>& image, int quality = 100);

}  // namespace sextant
