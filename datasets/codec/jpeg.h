#pragma once

// JPEG images (8-bit gray or colour) through libjpeg. JPEG is lossy: decoded pixels differ slightly from the
// encoded ones, even at quality 100.

#include <string>
#include <string_view>

#include "sextant/measurement/image.h"

namespace sextant {

/// Decodes an image. Throws Error if the bytes are not a JPEG file, if it is truncated or damaged, or if its
/// header claims more pixels than image_claim.h allows. Orientation tags are ignored.
Image<Rgb> decode_jpeg_rgb(std::string_view bytes, const std::string& name);

/// Encodes an image with `quality` 1..100.
std::string encode_jpeg(const Image<Rgb>& image, int quality = 100);

}  // namespace sextant
