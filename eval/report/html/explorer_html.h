#pragma once

// An Explorer (eval/report/document.h) as HTML: its data, which page/explorer.js draws. Lists are base64 of
// 32-bit little-endian numbers: float32 for drawn values, int32 for frames. The JSON inside the element:
//
//   {"time_title", "axes": [right, up, out], "curves": [title], "note",
//    "paths": [{"label", "is_reference", "colour", "n", "time", "frame" (null: time is the frame),
//               "position": [x, y, z] or [], "values": [list or null of each curve], "begins": [index]}]}

#include <string>

#include "sextant/eval/report/document.h"

namespace sextant {

std::string explorer_html(const Explorer& explorer);

}  // namespace sextant
