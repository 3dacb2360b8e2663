#include "sextant/measurement/image.h"

namespace sextant {

std::map<int, MaskOutline> mask_outlines(const Image<uint16_t>& mask) {
  std::map<int, MaskOutline> outlines;
  for (int y = 0; y < mask.height(); ++y) {
    const uint16_t* row = mask.row(y);
    for (int first = 0, end = 0; first < mask.width(); first = end) {
      while (end < mask.width() && row[end] == row[first]) ++end;
      if (row[first] == 0) continue;
      MaskOutline& outline = outlines[row[first]];
      outline.box.include(first, y);
      outline.box.include(end - 1, y);
      outline.n_pixels += end - first;
    }
  }
  return outlines;
}

}  // namespace sextant
