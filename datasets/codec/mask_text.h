#pragma once

// Instance masks as text (VDO-SLAM folders): one line per image row, integers 0..65535 separated by blanks
// or tabs, 0 = background. Trailing blanks, CRLF and empty lines at the end are accepted.

#include <string>
#include <string_view>

#include "sextant/measurement/image.h"

namespace sextant {

/// Throws Error "NAME:LINE:COLUMN: ..." on anything but a full matrix of such integers.
Image<uint16_t> decode_mask_text(std::string_view text, const std::string& name);

/// "0 0 1 \n": the layout of VDO-SLAM's own files.
std::string encode_mask_text(const Image<uint16_t>& mask);

}  // namespace sextant
