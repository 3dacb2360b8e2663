#include "sextant/datasets/synthetic/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sextant::synthetic {
namespace {

using Eigen::Vector3f;

/// A point of a texture with the lengths (m) over which it is averaged: along u and along v for patterns;
/// noise takes `n` round samples of `width_m` along the longer side of the footprint.
struct Sample {
  float u = 0;
  float v = 0;
  float width_u_m = 0;
  float width_v_m = 0;
  float width_m = 0;
  float major_u_m = 0;
  float major_v_m = 0;
  int n = 1;
};

/// std::floor for numbers that fit; without SSE4.1 the library's is a call.
int32_t floor_int(float x) {
  const auto towards_zero = static_cast<int32_t>(x);
  return towards_zero - static_cast<int32_t>(x < static_cast<float>(towards_zero));
}

/// Random values in [-1, 1), one for every cell of a square that repeats.
class Lattice {
 public:
  Lattice() noexcept {
    for (uint32_t i = 0; i < values_.size(); ++i) {
      values_[i] = static_cast<float>(hash3(i % kSide, i / kSide, 1)) * 0x1p-31F - 1.0F;
    }
  }
  float operator()(uint32_t x, uint32_t y) const { return values_[(y % kSide) * kSide + x % kSide]; }

 private:
  static constexpr uint32_t kSide = 256;
  std::array<float, kSide * kSide> values_{};
};

const Lattice kLattice;

float lattice(int32_t x, int32_t y, uint32_t seed) {
  return kLattice(static_cast<uint32_t>(x) + seed * 97U,
                  static_cast<uint32_t>(y) + (seed * 0x9e3779b1U >> 24));
}

/// Smooth noise in [-1, 1] with one random value per unit cell.
float value_noise(float x, float y, uint32_t seed) {
  const int32_t ix = floor_int(x), iy = floor_int(y);
  float a = x - static_cast<float>(ix), b = y - static_cast<float>(iy);
  a = a * a * (3 - 2 * a);
  b = b * b * (3 - 2 * b);
  const float top = lattice(ix, iy, seed) * (1 - a) + lattice(ix + 1, iy, seed) * a;
  const float bottom = lattice(ix, iy + 1, seed) * (1 - a) + lattice(ix + 1, iy + 1, seed) * a;
  return top * (1 - b) + bottom * b;
}

/// Noise with cells from 1.2 cm to 4 m, those below the filter width left out.
float grain(const Sample& s, uint32_t seed) {
  static const NoiseTile fine(1, 16, 1), coarse(2, 32, 2);
  constexpr float kFine_m = 0.012F, kCoarse_m = 0.13F;
  const float shift_u = static_cast<float>(seed & 255U), shift_v = static_cast<float>(seed >> 8 & 255U);
  const float sum = fine.mean(s.u / kFine_m + shift_u, s.v / kFine_m + shift_v, s.width_m / kFine_m, s.n,
                              s.major_u_m / kFine_m, s.major_v_m / kFine_m);
  // Turned, so that the tiles' edges do not line up.
  const float u = (0.8F * s.u - 0.6F * s.v) / kCoarse_m, v = (0.6F * s.u + 0.8F * s.v) / kCoarse_m;
  return sum + coarse.mean(u + shift_v, v + shift_u, s.width_m / kCoarse_m, 1, 0, 0);
}

/// Share of [x - w/2, x + w/2] that lies in [low, high].
float cover(float x, float width_m, float low, float high) {
  const float w = std::max(width_m, 1e-6F);
  return static_cast<float>(
      std::clamp((std::min(x + w / 2, high) - std::max(x - w / 2, low)) / w, 0.0F, 1.0F));
}

/// The same for [low, high] repeated with a period, 0 <= low <= high <= period.
float cover_periodic(float x, float width_m, float period_m, float low, float high) {
  const float w = std::max(width_m, 1e-6F);
  const float per_m = 1.0F / period_m;
  const auto integral = [&](float t) {
    const int32_t n = floor_int(t * per_m);
    return n * (high - low) + std::clamp(t - n * period_m - low, 0.0F, high - low);
  };
  return static_cast<float>((integral(x + w / 2) - integral(x - w / 2)) / w);
}

Vector3f mix(const Vector3f& a, const Vector3f& b, float t) { return a + t * (b - a); }

Vector3f asphalt(const Look& look, const Sample& s) {
  const float noise = grain(s, look.seed);
  // Repaired strips and cracks: where a coarse noise crosses zero.
  const float crack = value_noise(s.u / 1.7F, s.v / 1.7F, look.seed + 90);
  const float crack_width = 0.02F + s.width_m / 1.7F;
  const float dark = std::max(0.0F, 1.0F - std::abs(crack) / crack_width) * 0.02F / crack_width;
  return look.colour * std::max(0.2F, 1.0F + 0.16F * noise - 0.5F * dark);
}

/// White paint over the road's surface; it wears off in places.
Vector3f marked(const Look& look, const Sample& s, float white) {
  const Vector3f ground = asphalt(look, s);
  if (white <= 0) return ground;
  const float wear = 0.8F + 0.15F * grain(s, look.seed + 130);
  return mix(ground, {0.85F, 0.85F, 0.82F}, std::clamp(white * wear, 0.0F, 1.0F));
}

Vector3f road(const Look& look, const Sample& s) {
  float white = cover(s.u, s.width_u_m, -0.07F, 0.07F) * cover_periodic(s.v, s.width_v_m, 6.0F, 0.0F, 3.0F);
  for (const float side : {-look.extent, look.extent}) {
    white += cover(s.u, s.width_u_m, side - 0.07F, side + 0.07F);
  }
  return marked(look, s, white);
}

Vector3f paving(const Look& look, const Sample& s) {
  const float joint = std::max(cover_periodic(s.u, s.width_u_m, 0.6F, 0.0F, 0.025F),
                               cover_periodic(s.v, s.width_v_m, 0.6F, 0.0F, 0.025F));
  const auto slab_u = floor_int(s.u / 0.6F);
  const auto slab_v = floor_int(s.v / 0.6F);
  const auto sharp =
      static_cast<float>(std::clamp(0.6F / std::max(s.width_u_m, s.width_v_m) - 1.0F, 0.0F, 1.0F));
  const float slab = sharp * lattice(slab_u, slab_v, look.seed);
  const float noise = grain(s, look.seed + 20);
  return look.colour * std::max(0.15F, 1.0F + 0.10F * slab + 0.15F * noise - 0.45F * joint);
}

Vector3f windows(const Look& look, const Sample& s, const Vector3f& wall) {
  constexpr float kBay_m = 2.7F, kStorey_m = 3.1F;
  const auto bay = floor_int(s.u / kBay_m);
  const auto storey = floor_int(s.v / kStorey_m);
  const float opening = cover_periodic(s.u, s.width_u_m, kBay_m, 0.65F, 2.05F) *
                        cover_periodic(s.v, s.width_v_m, kStorey_m, 0.85F, 2.55F);
  const float pane = (cover_periodic(s.u, s.width_u_m, kBay_m, 0.73F, 1.31F) +
                      cover_periodic(s.u, s.width_u_m, kBay_m, 1.39F, 1.97F)) *
                     cover_periodic(s.v, s.width_v_m, kStorey_m, 0.93F, 2.47F);
  const float sill = cover_periodic(s.u, s.width_u_m, kBay_m, 0.5F, 2.2F) *
                     cover_periodic(s.v, s.width_v_m, kStorey_m, 0.70F, 0.85F);
  if (opening + sill <= 0) return wall;
  // Every window has its own darkness and curtain.
  const auto sharp =
      static_cast<float>(std::clamp(kBay_m / std::max(s.width_u_m, s.width_v_m) - 1.0F, 0.0F, 1.0F));
  const float lit = 0.5F + 0.5F * sharp * lattice(bay, storey, look.seed + 5);
  const float blind =
      2.47F - 1.2F * random01(static_cast<uint32_t>(bay), static_cast<uint32_t>(storey), look.seed);
  const float curtain = sharp * cover(s.v - storey * kStorey_m, s.width_v_m, blind, 2.47F) * 0.55F;
  const float reflection = pane <= 0 ? 0.0F : 0.10F * grain(s, look.seed + 60);
  const Vector3f glass =
      Vector3f(0.14F, 0.18F, 0.23F) * (0.7F + lit) + Vector3f::Constant(curtain + reflection);
  Vector3f colour = mix(wall, {0.72F, 0.70F, 0.66F}, std::min(1.0F, sill));
  colour = mix(colour, {0.82F, 0.81F, 0.78F}, opening);
  return mix(colour, glass.cwiseMax(0.03F), std::min(1.0F, pane));
}

Vector3f facade(const Look& look, const Sample& s) {
  const float stain = grain(s, look.seed + 10);
  // Courses of stone.
  const float joint = std::max(cover_periodic(s.v, s.width_v_m, 0.31F, 0.0F, 0.03F),
                               0.6F * cover_periodic(s.u, s.width_u_m, 0.9F, 0.0F, 0.03F));
  const Vector3f wall = look.colour * std::max(0.2F, 1.0F + 0.15F * stain - 0.30F * joint);
  const float ground_floor = cover(s.v, s.width_v_m, 0.0F, 0.8F);
  return mix(windows(look, s, wall), wall * 0.6F, ground_floor);
}

Vector3f paint(const Look& look, const Sample& s) {
  const float dirt = grain(s, look.seed + 10);
  const float seam =
      cover_periodic(s.u + 0.35F, s.width_u_m, 1.05F, 0.0F, 0.02F) + cover(s.v, s.width_v_m, 0.66F, 0.68F);
  return look.colour * std::max(0.1F, 1.0F + 0.07F * dirt - 0.5F * std::min(1.0F, seam));
}

Vector3f colour_at(const Look& look, const Sample& s) {
  switch (look.material) {
    case Material::asphalt:
      return asphalt(look, s);
    case Material::road:
      return road(look, s);
    case Material::stripes:
      return marked(look, s, cover_periodic(s.u, s.width_u_m, 1.0F, 0.25F, 0.75F));
    case Material::paving:
      return paving(look, s);
    case Material::facade:
      return facade(look, s);
    case Material::paint:
      return paint(look, s);
    case Material::grass:
      return look.colour * std::max(0.15F, 1.0F + 0.20F * grain(s, look.seed));
    case Material::foliage:
      return look.colour * std::max(0.1F, 0.85F + 0.50F * grain(s, look.seed));
    case Material::bark:
      return look.colour * std::max(0.2F, 1.0F + 0.22F * grain(s, look.seed));
    case Material::glass:
      return look.colour * std::max(0.2F, 1.0F + 0.18F * grain(s, look.seed));
    case Material::plaster:
    case Material::metal:
    case Material::tyre:
      break;
  }
  return look.colour * std::max(0.2F, 1.0F + 0.13F * grain(s, look.seed));
}

}  // namespace

Vector3f surface_colour(const Look& look, const Footprint& f) {
  constexpr int kMaxSamples = 3;
  const float along_x = std::sqrt(f.u_x * f.u_x + f.v_x * f.v_x);
  const float along_y = std::sqrt(f.u_y * f.u_y + f.v_y * f.v_y);
  const bool x_longer = along_x > along_y;
  const float major_m = x_longer ? along_x : along_y;
  const float minor_m = std::max(x_longer ? along_y : along_x, 1e-6F);
  Sample s;
  s.u = f.u;
  s.v = f.v;
  s.n = std::clamp(static_cast<int>(major_m / minor_m * 0.7F) + 1, 1, kMaxSamples);
  s.major_u_m = x_longer ? f.u_x : f.u_y;
  s.major_v_m = x_longer ? f.v_x : f.v_y;
  s.width_u_m = std::max(std::abs(f.u_x), std::abs(f.u_y));
  s.width_v_m = std::max(std::abs(f.v_x), std::abs(f.v_y));
  s.width_m = std::max(major_m / static_cast<float>(s.n), minor_m);
  return colour_at(look, s);
}

Vector3f sky_colour(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d d = direction.normalized();
  const auto up = static_cast<float>(std::clamp(-d.y(), 0.0, 1.0));
  const Vector3f clear = mix({0.80F, 0.86F, 0.93F}, {0.30F, 0.50F, 0.80F}, std::sqrt(up));
  // Clouds on a plane high above, fading to the horizon.
  const auto height = static_cast<float>(1.0 / std::max(-d.y(), 0.02));
  Sample s;
  s.u = static_cast<float>(d.x()) * height;
  s.v = static_cast<float>(d.z()) * height;
  s.width_m = 0.10F + 0.004F * height * height;
  const float cloud = std::clamp(0.25F + 0.45F * grain(s, 4711), 0.0F, 0.8F);
  return mix(clear, {0.95F, 0.95F, 0.96F}, cloud);
}

}  // namespace sextant::synthetic
