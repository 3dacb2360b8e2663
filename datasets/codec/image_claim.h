#pragma once

// Limits on the declared size of an image file, checked before memory of that size is allocated.
//
//   pixels            at most 2^27
//   decoded bytes     at most 64 MB, or 200 times the size of the file if that is larger
//
// The second limit rejects decompression bombs: camera images, depth, flow and masks of more than 64 MB are
// never compressed to that degree. Masks as text have limits of their own (dense_maps.cc, mots.cc).

#include <algorithm>
#include <cstdint>
#include <string>

#include "sextant/base/error.h"

namespace sextant {

inline constexpr uint64_t max_image_pixels = uint64_t{1} << 27;

/// Throws Error if the limits are exceeded. `kind` names the format in messages; `decoded_bytes` is the
/// memory needed for decoding, including buffers.
inline void check_image_claim(const char* kind, const std::string& name, uint64_t width, uint64_t height,
                              uint64_t decoded_bytes, uint64_t file_bytes) {
  constexpr uint64_t free_bytes = 64'000'000, max_ratio = 200;
  if (width * height > max_image_pixels) {
    fail("{}: its header claims a {} of {}x{} pixels, expected at most {} pixels: is the file damaged?", name,
         kind, width, height, max_image_pixels);
  }
  if (decoded_bytes <= std::max(free_bytes, max_ratio * file_bytes)) return;
  fail(
      "{}: its header claims a {} of {}x{} pixels, which is {} MB from a file of {} bytes, expected at most "
      "64 MB or {} times the file: is the file damaged?",
      name, kind, width, height, decoded_bytes / 1'000'000, file_bytes, max_ratio);
}

}  // namespace sextant
