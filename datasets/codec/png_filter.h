#pragma once

// The five PNG row filters (ISO/IEC 15948, 9.2): x is the byte, a its left, b its upper, c its upper left
// neighbour (0 outside of the image).
//
//   0 none x | 1 sub x - a | 2 up x - b | 3 average x - floor((a + b) / 2) | 4 Paeth x - nearest(a, b, c)

#include <cstddef>
#include <cstdint>

namespace sextant::internal {

/// Number of bytes past the end of a row that png_unfilter() may read, since it processes 8 bytes at a time.
constexpr size_t png_row_slack = 8;

/// Inverts `filter` in place; png_row_slack bytes after both rows must be readable. `prior` is the unfiltered
/// row above; nullptr for the first row. `bytes_per_pixel` is 1, 2, 3, 4, 6 or 8. Returns false if there is
/// no such filter.
bool png_unfilter(int filter, uint8_t* row, const uint8_t* prior, size_t n, int bytes_per_pixel);

/// Applies `filter` (0..4) to `row`; `prior` is the row above, not filtered.
void png_filter(int filter, const uint8_t* row, const uint8_t* prior, size_t n, int bytes_per_pixel,
                uint8_t* filtered);

}  // namespace sextant::internal
