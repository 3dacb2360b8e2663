#pragma once

// Middlebury .flo optical flow: "PIEH" (the float 202021.25), int32 width, int32 height, then width*height
// pairs of float (u, v), px, row by row; all little-endian. A component beyond 1e9 or NaN means "unknown",
// which is an invalid Flow here. Source: vision.middlebury.edu/flow/code/flow-code/README.txt

#include <string>
#include <string_view>

#include "sextant/measurement/image.h"

namespace sextant {

/// Throws Error on another magic number or a number of bytes that does not fit the size in the header.
Image<Flow> decode_flo(std::string_view bytes, const std::string& name);

/// Invalid pixels are written as 1e10, as the format has it.
std::string encode_flo(const Image<Flow>& flow);

}  // namespace sextant
