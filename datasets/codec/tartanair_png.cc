#include "sextant/datasets/codec/tartanair_png.h"

#include <bit>
#include <cmath>
#include <limits>

namespace sextant {

Image<float> depth_from_tartanair(const Image<Rgba>& image) {
  return image_of(image.width(), image.height(), [&](int x, int y) {
    const Rgba p = image(x, y);
    const float z = std::bit_cast<float>(uint32_t{p.b} | uint32_t{p.g} << 8 | uint32_t{p.r} << 16 |
                                         uint32_t{p.a} << 24);
    return z > 0 && z < tartanair_sky_m ? z : std::numeric_limits<float>::quiet_NaN();
  });
}

Image<Flow> flow_from_tartanair(const Image<Rgb16>& image) {
  return image_of(image.width(), image.height(), [&](int x, int y) {
    const Rgb16 p = image(x, y);
    if (p.r != 0) return Flow{};
    return Flow{(static_cast<float>(p.b) - 32768.0f) / 64.0f, (static_cast<float>(p.g) - 32768.0f) / 64.0f};
  });
}

Image<Rgba> tartanair_from_depth(const Image<float>& depth_m) {
  return image_of(depth_m.width(), depth_m.height(), [&](int x, int y) {
    const float z = depth_m(x, y);
    const auto bits = std::bit_cast<uint32_t>(std::isfinite(z) ? z : 0.0f);
    const auto byte = [&](int i) { return static_cast<uint8_t>(bits >> (8 * i)); };
    return Rgba{byte(2), byte(1), byte(0), byte(3)};
  });
}

Image<Rgb16> tartanair_from_flow(const Image<Flow>& flow) {
  return image_of(flow.width(), flow.height(), [&](int x, int y) {
    const Flow f = flow(x, y);
    const double u = std::round(64.0 * f.u + 32768.0), v = std::round(64.0 * f.v + 32768.0);
    if (!(u >= 0 && u <= 65535 && v >= 0 && v <= 65535)) return Rgb16{1, 0, 0};
    return Rgb16{0, static_cast<uint16_t>(v), static_cast<uint16_t>(u)};
  });
}

}  // namespace sextant
