#include "sextant/noise/mask_noise.h"

namespace sextant {
namespace {

struct Offset {
  int dx;
  int dy;
};

constexpr Offset offsets[] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}};

/// Calls body(id) for the id of every neighbour inside the image.
template <typename Body>
void for_neighbours(const Image<uint16_t>& mask, int x, int y, int neighbours, Body body) {
  for (const Offset& offset : std::span(offsets).first(neighbours)) {
    if (mask.contains(x + offset.dx, y + offset.dy)) body(mask(x + offset.dx, y + offset.dy));
  }
}

uint16_t eroded(const Image<uint16_t>& mask, int x, int y, int neighbours) {
  const uint16_t id = mask(x, y);
  bool edge = false;
  for_neighbours(mask, x, y, neighbours, [&](uint16_t other) { edge = edge || other != id; });
  return edge ? 0 : id;
}

uint16_t dilated(const Image<uint16_t>& mask, int x, int y, int neighbours) {
  uint16_t smallest = 0;
  for_neighbours(mask, x, y, neighbours, [&](uint16_t other) {
    if (other != 0 && (smallest == 0 || other < smallest)) smallest = other;
  });
  return smallest;
}

template <typename Step>
void repeat(Image<uint16_t>& mask, int times, Step step) {
  for (int i = 0; i < times; ++i) {
    Image<uint16_t> next = mask;
    for (int y = 0; y < mask.height(); ++y) {
      for (int x = 0; x < mask.width(); ++x) step(mask, next, x, y);
    }
    if (next == mask) return;
    mask = std::move(next);
  }
}

}  // namespace

void MaskNoiseOptions::check() const {
  check_option(erode_px >= 0, "mask.erode_px", erode_px, ">= 0");
  check_option(dilate_px >= 0, "mask.dilate_px", dilate_px, ">= 0");
  check_option(neighbours == 4 || neighbours == 8, "mask.neighbours", neighbours, "4 or 8");
}

std::string MaskNoise::name() const {
  if (!changes_masks()) return "";
  std::string text = "mask";
  if (options_.erode_px > 0) text += fmt::format(" eroded {} px", options_.erode_px);
  if (options_.dilate_px > 0) text += fmt::format(" dilated {} px", options_.dilate_px);
  if (options_.neighbours != MaskNoiseOptions{}.neighbours)
    text += fmt::format(" by {}", options_.neighbours);
  return text;
}

void MaskNoise::corrupt_mask(Image<uint16_t>& mask) const {
  const int n = options_.neighbours;
  repeat(mask, options_.erode_px, [n](const Image<uint16_t>& from, Image<uint16_t>& to, int x, int y) {
    if (from(x, y) != 0) to(x, y) = eroded(from, x, y, n);
  });
  repeat(mask, options_.dilate_px, [n](const Image<uint16_t>& from, Image<uint16_t>& to, int x, int y) {
    if (from(x, y) == 0) to(x, y) = dilated(from, x, y, n);
  });
}

}  // namespace sextant
