#include "sextant/datasets/codec/kitti_png.h"

#include <cmath>
#include <limits>

namespace sextant {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

template <typename To, typename From, typename Map>
Image<To> map_pixels(const Image<From>& image, Map map) {
  Image<To> out(image.width(), image.height());
  for (size_t i = 0; i < image.size(); ++i) out.data()[i] = map(image.data()[i]);
  return out;
}

bool rounds_into(double x, double first, double last) {
  return std::round(x) >= first && std::round(x) <= last;
}

uint16_t rounded(double x) { return static_cast<uint16_t>(std::lround(x)); }

}  // namespace

Image<float> depth_from_disparity256(const Image<uint16_t>& disparity, double bf) {
  const double scale = 256.0 * bf;
  return map_pixels<float>(disparity, [scale](uint16_t n) {
    return n == 0 ? nan : static_cast<float>(scale / static_cast<double>(n));
  });
}

Image<float> depth_from_depth256(const Image<uint16_t>& depth) {
  return map_pixels<float>(depth, [](uint16_t n) { return n == 0 ? nan : static_cast<float>(n) / 256.0f; });
}

Image<float> depth_from_cm(const Image<uint16_t>& depth_cm) {
  return map_pixels<float>(depth_cm, [](uint16_t n) {
    return n == 65535 ? nan : static_cast<float>(static_cast<double>(n) / 100.0);
  });
}

Image<Flow> flow_from_kitti(const Image<Rgb16>& image) {
  return map_pixels<Flow>(image, [](Rgb16 p) {
    if (p.b == 0) return Flow{};
    return Flow{(static_cast<float>(p.r) - 32768.0f) / 64.0f, (static_cast<float>(p.g) - 32768.0f) / 64.0f};
  });
}

Image<Flow> flow_from_vkitti(const Image<Rgb16>& image) {
  const double w = image.width() - 1;
  const double h = image.height() - 1;
  return map_pixels<Flow>(image, [w, h](Rgb16 p) {
    if (p.b == 0) return Flow{};
    return Flow{static_cast<float>((2.0 * p.r / 65535.0 - 1.0) * w),
                static_cast<float>((2.0 * p.g / 65535.0 - 1.0) * h)};
  });
}

Image<uint16_t> disparity256_from_depth(const Image<float>& depth_m, double bf) {
  return map_pixels<uint16_t>(depth_m, [bf](float z) -> uint16_t {
    const double n = 256.0 * bf / z;
    return z > 0 && rounds_into(n, 1, 65535) ? rounded(n) : 0;
  });
}

Image<uint16_t> depth256_from_depth(const Image<float>& depth_m) {
  return map_pixels<uint16_t>(depth_m, [](float z) -> uint16_t {
    const double n = 256.0 * z;
    return rounds_into(n, 1, 65535) ? rounded(n) : 0;
  });
}

Image<uint16_t> cm_from_depth(const Image<float>& depth_m) {
  return map_pixels<uint16_t>(depth_m, [](float z) -> uint16_t {
    const double n = 100.0 * z;
    return rounds_into(n, 0, 65534) ? rounded(n) : 65535;
  });
}

Image<Rgb16> kitti_from_flow(const Image<Flow>& flow) {
  return map_pixels<Rgb16>(flow, [](Flow f) {
    const double r = 64.0 * f.u + 32768.0;
    const double g = 64.0 * f.v + 32768.0;
    if (!rounds_into(r, 0, 65535) || !rounds_into(g, 0, 65535)) return Rgb16{};
    return Rgb16{rounded(r), rounded(g), 1};
  });
}

Image<Rgb16> vkitti_from_flow(const Image<Flow>& flow) {
  const double w = flow.width() - 1;
  const double h = flow.height() - 1;
  return map_pixels<Rgb16>(flow, [w, h](Flow f) {
    const double r = (f.u / w + 1.0) / 2.0 * 65535.0;
    const double g = (f.v / h + 1.0) / 2.0 * 65535.0;
    if (!rounds_into(r, 0, 65535) || !rounds_into(g, 0, 65535)) return Rgb16{};
    return Rgb16{rounded(r), rounded(g), 65535};
  });
}

}  // namespace sextant
