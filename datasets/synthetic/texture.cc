#include "sextant/datasets/synthetic/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sextant::synthetic {
namespace {

using Eigen::Vector3f;

/// A point of a texture with the lengths (m) over which it is averaged: along u and along v for patterns;
/// noise takes `n` round samples of `width_m` along the long axis.
struct Sample {
  double u = 0;
  double v = 0;
  double width_u_m = 0;
  double width_v_m = 0;
  double width_m = 0;
  double major_u_m = 0;  ///< half of the long axis
  double major_v_m = 0;
  int n = 1;
};

/// std::floor for numbers that fit; without SSE4.1 the library's is a call.
int32_t floor_int(double x) {
  const auto towards_zero = static_cast<int32_t>(x);
  return towards_zero - static_cast<int32_t>(x < towards_zero);
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
float value_noise(double x, double y, uint32_t seed) {
  const int32_t ix = floor_int(x), iy = floor_int(y);
  auto a = static_cast<float>(x - ix), b = static_cast<float>(y - iy);
  a = a * a * (3 - 2 * a);
  b = b * b * (3 - 2 * b);
  const float top = lattice(ix, iy, seed) * (1 - a) + lattice(ix + 1, iy, seed) * a;
  const float bottom = lattice(ix, iy + 1, seed) * (1 - a) + lattice(ix + 1, iy + 1, seed) * a;
  return top * (1 - b) + bottom * b;
}

/// Octaves of noise with cells from `coarse_m` down to `fine_m`, those below the filter width left out.
float fractal(const Sample& s, uint32_t seed, double coarse_m, double fine_m) {
  float sum = 0;
  double u = s.u, v = s.v, du = s.major_u_m, dv = s.major_v_m;
  const double length_m = s.n > 1 ? s.n * s.width_m : 0.0;
  for (double cell_m = coarse_m; cell_m >= fine_m; cell_m *= 0.42) {
    const double visible = std::min(cell_m / s.width_m - 1.0, 1.0);
    if (visible <= 0) break;
    ++seed;
    const double per_m = 1.0 / cell_m;
    float octave = 0;
    if (cell_m > 2 * length_m) {
      octave = value_noise(u * per_m, v * per_m, seed);
    } else {
      for (int i = 0; i < s.n; ++i) {
        const double at = (2.0 * i + 1.0) / s.n - 1.0;
        octave += value_noise((u + at * du) * per_m, (v + at * dv) * per_m, seed);
      }
      octave /= static_cast<float>(s.n);
    }
    sum += static_cast<float>(visible) * octave;
    // Turned, so that the cells' edges do not line up.
    const double turned_u = 0.8 * u - 0.6 * v, turned_du = 0.8 * du - 0.6 * dv;
    v = 0.6 * u + 0.8 * v + 3.7;
    dv = 0.6 * du + 0.8 * dv;
    u = turned_u + 1.3;
    du = turned_du;
  }
  return sum;
}

/// Share of [x - w/2, x + w/2] that lies in [low, high].
float cover(double x, double width_m, double low, double high) {
  const double w = std::max(width_m, 1e-6);
  return static_cast<float>(std::clamp((std::min(x + w / 2, high) - std::max(x - w / 2, low)) / w, 0.0, 1.0));
}

/// The same for [low, high] repeated with a period, 0 <= low <= high <= period.
float cover_periodic(double x, double width_m, double period_m, double low, double high) {
  const double w = std::max(width_m, 1e-6);
  const double per_m = 1.0 / period_m;
  const auto integral = [&](double t) {
    const int32_t n = floor_int(t * per_m);
    return n * (high - low) + std::clamp(t - n * period_m - low, 0.0, high - low);
  };
  return static_cast<float>((integral(x + w / 2) - integral(x - w / 2)) / w);
}

Vector3f mix(const Vector3f& a, const Vector3f& b, float t) { return a + t * (b - a); }

Vector3f asphalt(const Look& look, const Sample& s) {
  const float grain = fractal(s, look.seed, 2.0, 0.012);
  const float patchy = fractal(s, look.seed + 50, 6.0, 1.5);
  // Repaired strips and cracks: where a coarse noise crosses zero.
  const float crack = value_noise(s.u / 1.7, s.v / 1.7, look.seed + 90);
  const double crack_width = 0.02 + s.width_m / 1.7;
  const auto dark =
      static_cast<float>(std::max(0.0, 1.0 - std::abs(crack) / crack_width) * 0.02 / crack_width);
  return look.colour * std::max(0.2F, 1.0F + 0.17F * grain + 0.07F * patchy - 0.5F * dark);
}

/// White paint over the road's surface; it wears off in places.
Vector3f marked(const Look& look, const Sample& s, float white) {
  const Vector3f ground = asphalt(look, s);
  if (white <= 0) return ground;
  const float wear = 0.8F + 0.15F * fractal(s, look.seed + 130, 0.5, 0.02);
  return mix(ground, {0.85F, 0.85F, 0.82F}, std::clamp(white * wear, 0.0F, 1.0F));
}

Vector3f road(const Look& look, const Sample& s) {
  float white = cover(s.u, s.width_u_m, -0.07, 0.07) * cover_periodic(s.v, s.width_v_m, 6.0, 0.0, 3.0);
  for (const double side : {-look.extent, look.extent}) {
    white += cover(s.u, s.width_u_m, side - 0.07, side + 0.07);
  }
  return marked(look, s, white);
}

Vector3f paving(const Look& look, const Sample& s) {
  const float joint = std::max(cover_periodic(s.u, s.width_u_m, 0.6, 0.0, 0.025),
                               cover_periodic(s.v, s.width_v_m, 0.6, 0.0, 0.025));
  const auto slab_u = floor_int(s.u / 0.6);
  const auto slab_v = floor_int(s.v / 0.6);
  const auto sharp = static_cast<float>(std::clamp(0.6 / std::max(s.width_u_m, s.width_v_m) - 1.0, 0.0, 1.0));
  const float slab = sharp * lattice(slab_u, slab_v, look.seed);
  const float grain = fractal(s, look.seed + 20, 3.0, 0.015);
  return look.colour * std::max(0.15F, 1.0F + 0.10F * slab + 0.15F * grain - 0.45F * joint);
}

Vector3f windows(const Look& look, const Sample& s, const Vector3f& wall) {
  constexpr double kBay_m = 2.7, kStorey_m = 3.1;
  const auto bay = floor_int(s.u / kBay_m);
  const auto storey = floor_int(s.v / kStorey_m);
  const float opening = cover_periodic(s.u, s.width_u_m, kBay_m, 0.65, 2.05) *
                        cover_periodic(s.v, s.width_v_m, kStorey_m, 0.85, 2.55);
  const float pane = (cover_periodic(s.u, s.width_u_m, kBay_m, 0.73, 1.31) +
                      cover_periodic(s.u, s.width_u_m, kBay_m, 1.39, 1.97)) *
                     cover_periodic(s.v, s.width_v_m, kStorey_m, 0.93, 2.47);
  const float sill = cover_periodic(s.u, s.width_u_m, kBay_m, 0.5, 2.2) *
                     cover_periodic(s.v, s.width_v_m, kStorey_m, 0.70, 0.85);
  if (opening + sill <= 0) return wall;
  // Every window has its own darkness and curtain.
  const auto sharp =
      static_cast<float>(std::clamp(kBay_m / std::max(s.width_u_m, s.width_v_m) - 1.0, 0.0, 1.0));
  const float lit = 0.5F + 0.5F * sharp * lattice(bay, storey, look.seed + 5);
  const double blind =
      2.47 - 1.2 * random01(static_cast<uint32_t>(bay), static_cast<uint32_t>(storey), look.seed);
  const float curtain = sharp * cover(s.v - storey * kStorey_m, s.width_v_m, blind, 2.47) * 0.55F;
  const float reflection = pane <= 0 ? 0.0F : 0.10F * fractal(s, look.seed + 60, 1.5, 0.03);
  const Vector3f glass =
      Vector3f(0.14F, 0.18F, 0.23F) * (0.7F + lit) + Vector3f::Constant(curtain + reflection);
  Vector3f colour = mix(wall, {0.72F, 0.70F, 0.66F}, std::min(1.0F, sill));
  colour = mix(colour, {0.82F, 0.81F, 0.78F}, opening);
  return mix(colour, glass.cwiseMax(0.03F), std::min(1.0F, pane));
}

Vector3f facade(const Look& look, const Sample& s) {
  const float stain = fractal(s, look.seed + 10, 3.0, 0.012);
  // Courses of stone.
  const float joint = std::max(cover_periodic(s.v, s.width_v_m, 0.31, 0.0, 0.03),
                               0.6F * cover_periodic(s.u, s.width_u_m, 0.9, 0.0, 0.03));
  const Vector3f wall = look.colour * std::max(0.2F, 1.0F + 0.15F * stain - 0.30F * joint);
  const float ground_floor = cover(s.v, s.width_v_m, 0.0, 0.8);
  return mix(windows(look, s, wall), wall * 0.6F, ground_floor);
}

Vector3f paint(const Look& look, const Sample& s) {
  const float dirt = fractal(s, look.seed + 10, 0.8, 0.02);
  const float seam =
      cover_periodic(s.u + 0.35, s.width_u_m, 1.05, 0.0, 0.02) + cover(s.v, s.width_v_m, 0.66, 0.68);
  return look.colour * std::max(0.1F, 1.0F + 0.07F * dirt - 0.5F * std::min(1.0F, seam));
}

Vector3f colour_at(const Look& look, const Sample& s) {
  switch (look.material) {
    case Material::asphalt:
      return asphalt(look, s);
    case Material::road:
      return road(look, s);
    case Material::stripes:
      return marked(look, s, cover_periodic(s.u, s.width_u_m, 1.0, 0.25, 0.75));
    case Material::paving:
      return paving(look, s);
    case Material::facade:
      return facade(look, s);
    case Material::paint:
      return paint(look, s);
    case Material::grass:
      return look.colour * std::max(0.15F, 1.0F + 0.20F * fractal(s, look.seed, 3.0, 0.02));
    case Material::foliage:
      return look.colour * std::max(0.1F, 0.85F + 0.50F * fractal(s, look.seed, 0.6, 0.02));
    case Material::bark:
      return look.colour * std::max(0.2F, 1.0F + 0.22F * fractal(s, look.seed, 0.4, 0.02));
    case Material::glass:
      return look.colour * std::max(0.2F, 1.0F + 0.18F * fractal(s, look.seed, 0.9, 0.05));
    case Material::plaster:
    case Material::metal:
    case Material::tyre:
      break;
  }
  return look.colour * std::max(0.2F, 1.0F + 0.13F * fractal(s, look.seed, 2.0, 0.015));
}

}  // namespace

Vector3f surface_colour(const Look& look, const Footprint& footprint) {
  constexpr int kMaxSamples = 4;
  const double length_m = footprint.major_m.norm();
  const double minor_m = std::max(footprint.minor_m, 1e-6);
  Sample s;
  s.u = footprint.u;
  s.v = footprint.v;
  s.n = std::clamp(static_cast<int>(std::ceil(length_m / minor_m * 0.7)), 1, kMaxSamples);
  s.major_u_m = footprint.major_m.x();
  s.major_v_m = footprint.major_m.y();
  s.width_u_m = 2 * std::max(std::abs(s.major_u_m), minor_m);
  s.width_v_m = 2 * std::max(std::abs(s.major_v_m), minor_m);
  s.width_m = 2 * std::max(length_m / s.n, minor_m);
  return colour_at(look, s);
}

Vector3f sky_colour(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d d = direction.normalized();
  const auto up = static_cast<float>(std::clamp(-d.y(), 0.0, 1.0));
  const Vector3f clear = mix({0.80F, 0.86F, 0.93F}, {0.30F, 0.50F, 0.80F}, std::sqrt(up));
  // Clouds on a plane high above, fading to the horizon.
  Sample s;
  const double height = 1.0 / std::max(-d.y(), 0.02);
  s.u = d.x() * height;
  s.v = d.z() * height;
  s.width_m = 0.004 * height * height;
  const float cloud = std::clamp(0.25F + 0.45F * fractal(s, 4711, 3.0, 0.1), 0.0F, 0.8F);
  return mix(clear, {0.95F, 0.95F, 0.96F}, cloud);
}

}  // namespace sextant::synthetic
