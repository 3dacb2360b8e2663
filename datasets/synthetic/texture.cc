#include "sextant/datasets/synthetic/texture.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/datasets/synthetic/mesh.h"

namespace sextant::synthetic {
namespace {

constexpr float range = 4.0F;
constexpr int tile_side = NoiseTile::tile_side;

/// A level of the tile with `side` texels in each direction.
struct Level {
  int side = 0;
  std::vector<float> values;
  float operator()(int x, int y) const { return values[static_cast<size_t>(y % side) * side + x % side]; }
};

Level octaves(int finest, int coarsest, unsigned seed) {
  Level level{tile_side, std::vector<float>(static_cast<size_t>(tile_side) * tile_side)};
  for (int cell = finest; cell <= coarsest; cell *= 2) {
    const int n = tile_side / cell;
    const auto value = [&](int i, int j) {
      const uint32_t h = hash3(static_cast<uint32_t>(i % n), static_cast<uint32_t>(j % n), seed * 64 + cell);
      return static_cast<float>(h) * 0x1p-31F - 1.0F;
    };
    for (int y = 0; y < tile_side; ++y) {
      for (int x = 0; x < tile_side; ++x) {
        float a = static_cast<float>(x % cell) / static_cast<float>(cell);
        float b = static_cast<float>(y % cell) / static_cast<float>(cell);
        a = a * a * (3 - 2 * a);
        b = b * b * (3 - 2 * b);
        const int i = x / cell, j = y / cell;
        const float upper = value(i, j) * (1 - a) + value(i + 1, j) * a;
        const float lower = value(i, j + 1) * (1 - a) + value(i + 1, j + 1) * a;
        level.values[static_cast<size_t>(y) * tile_side + x] += upper * (1 - b) + lower * b;
      }
    }
  }
  return level;
}

Level halved(const Level& finer) {
  Level level{finer.side / 2, {}};
  for (int y = 0; y < level.side; ++y) {
    for (int x = 0; x < level.side; ++x) {
      const int i = 2 * x, j = 2 * y;
      level.values.push_back((finer(i, j) + finer(i + 1, j) + finer(i, j + 1) + finer(i + 1, j + 1)) / 4);
    }
  }
  return level;
}

/// Positions of bilinear look-ups on both levels: words of the corners, and weights between them.
struct Places {
  alignas(32) int32_t index[2][NoiseTile::batch];
  alignas(32) uint32_t word[2][NoiseTile::batch];
  alignas(32) float a[2][NoiseTile::batch];
  alignas(32) float b[2][NoiseTile::batch];
  alignas(32) float part[NoiseTile::batch];  ///< weight of the coarser level
};

SEXTANT_INLINED void place(Places& p, int which, int i, float x, float y, int32_t level) {
  // Levels are stored one after the other: 0, 65536, 65536 + 16384, ...
  constexpr int32_t all_channels = 0x15555;
  const int32_t first = all_channels - (all_channels >> 2 * level), mask = (tile_side - 1) >> level;
  const auto scale = std::bit_cast<float>((127 - level) << 23);
  const float offset = 0.5F * scale - 0.5F;  // texel centres of a level lie between those of the finer one
  const float at_x = x * scale + offset, at_y = y * scale + offset;
  const int32_t ix = wide::floor_int(at_x), iy = wide::floor_int(at_y);
  p.index[which][i] = first + ((iy & mask) * (mask + 1)) + (ix & mask);
  p.a[which][i] = at_x - static_cast<float>(ix);
  p.b[which][i] = at_y - static_cast<float>(iy);
}

SEXTANT_SIMD void find(const float* __restrict x, const float* __restrict y, const float* __restrict width,
                       int n, Places& p) {
  for (int i = 0; i < n; ++i) {
    // The logarithm to base 2, linear between powers of two: sufficient for a smooth choice of the level.
    const auto bits = std::bit_cast<int32_t>(wide::max(width[i], 1.0F));
    const float level = wide::min(static_cast<float>(bits) * 0x1p-23F - 127.0F, NoiseTile::levels - 1.001F);
    const auto low = static_cast<int32_t>(level);
    p.part[i] = level - static_cast<float>(low);
    place(p, 0, i, x[i], y[i], low);
    place(p, 1, i, x[i], y[i], low + 1);
  }
}

SEXTANT_INLINED float blend(uint32_t word, float a, float b) {
  const auto corner = [&](int shift) {
    return static_cast<float>(static_cast<int32_t>(word >> shift & 255U));
  };
  const float upper = wide::mix(corner(0), corner(8), a);
  const float lower = wide::mix(corner(16), corner(24), a);
  return wide::mix(upper, lower, b);
}

SEXTANT_SIMD void blend_all(const Places& p, const float* __restrict weight, int n, float* __restrict sum) {
  for (int i = 0; i < n; ++i) {
    const float fine = blend(p.word[0][i], p.a[0][i], p.b[0][i]);
    const float coarse = blend(p.word[1][i], p.a[1][i], p.b[1][i]);
    sum[i] += weight[i] * (wide::mix(fine, coarse, p.part[i]) - 127.5F) * (range / 127.5F);
  }
}

}  // namespace

NoiseTile::NoiseTile(int finest, int coarsest, unsigned seed) {
  Level level = octaves(finest, coarsest, seed);
  const auto byte = [&](int x, int y) {
    return static_cast<uint32_t>(std::lround(std::clamp(level(x, y) / range, -1.0F, 1.0F) * 127.5F + 127.5F));
  };
  for (int i = 0; i < levels; ++i) {
    for (int y = 0; y < level.side; ++y) {
      for (int x = 0; x < level.side; ++x) {
        corners_.push_back(byte(x, y) | byte(x + 1, y) << 8 | byte(x, y + 1) << 16 |
                           byte(x + 1, y + 1) << 24);
      }
    }
    level = halved(level);
  }
}

void NoiseTile::add_means(const float* x, const float* y, const float* width, const float* weight, int n,
                          float* sum) const {
  SEXTANT_CHECK(n <= batch);
  const int whole = wide::whole(n);
  Places p;
  find(x, y, width, whole, p);
  for (int which = 0; which < 2; ++which) {
    for (int i = 0; i < whole; ++i) p.word[which][i] = corners_[p.index[which][i]];
  }
  blend_all(p, weight, whole, sum);
}

namespace {

using wide::clamp;
using wide::floor_int;
using wide::max;
using wide::min;
using wide::mix;

constexpr int batch = NoiseTile::batch;
constexpr int max_samples = 3;

/// Returns random bits of a cell of a pattern.
SEXTANT_INLINED uint32_t cell_bits(int32_t x, int32_t y, uint32_t seed) {
  uint32_t h = static_cast<uint32_t>(x) * 0x9e3779b1U ^ static_cast<uint32_t>(y) * 0x85ebca77U ^ seed;
  h = (h ^ (h >> 15)) * 0x2c1b3c6dU;
  return h ^ (h >> 14);
}
/// Maps 16 bits to [0, 1).
SEXTANT_INLINED float unit(uint32_t bits16) {
  return static_cast<float>(static_cast<int32_t>(bits16)) * 0x1p-16F;
}

/// Returns the share of [x - w/2, x + w/2] that lies in [low, high].
SEXTANT_INLINED float cover(float x, float width_m, float low, float high) {
  const float w = max(width_m, 1e-6F);
  return clamp((min(x + 0.5F * w, high) - max(x - 0.5F * w, low)) / w, 0.0F, 1.0F);
}

/// Returns the share for [low, high] repeated with a period, 0 <= low <= high <= period.
SEXTANT_INLINED float cover_periodic(float x, float width_m, float period_m, float low, float high) {
  const float w = max(width_m, 1e-6F);
  const float per_m = 1.0F / period_m;
  const auto integral = [&](float t) {
    const auto n = static_cast<float>(floor_int(t * per_m));
    return n * (high - low) + clamp(t - n * period_m - low, 0.0F, high - low);
  };
  return (integral(x + 0.5F * w) - integral(x - 0.5F * w)) / w;
}

/// Positions of the `which`th noise sample of each footprint, in texels, and its weight.
struct NoiseSamples {
  Lane x, y, width, weight;
};

SEXTANT_SIMD void fine_samples(const Footprints& f, int n, int which, float shift_u, float shift_v,
                               NoiseSamples& s) {
  constexpr float texels_per_m = 1.0F / 0.012F;
  for (int i = 0; i < n; ++i) {
    const float each = 1.0F / f.count[i];
    const float along = (static_cast<float>(which) + 0.5F) * each - 0.5F;
    s.x[i] = (f.u[i] + along * f.along_u[i]) * texels_per_m + shift_u;
    s.y[i] = (f.v[i] + along * f.along_v[i]) * texels_per_m + shift_v;
    s.width[i] = f.width[i] * texels_per_m;
    s.weight[i] = static_cast<float>(which) < f.count[i] ? each : 0.0F;
  }
}

SEXTANT_SIMD void coarse_samples(const Footprints& f, int n, float shift_u, float shift_v, NoiseSamples& s) {
  constexpr float texels_per_m = 1.0F / 0.26F;
  for (int i = 0; i < n; ++i) {
    // Rotated, so that the edges of the tiles are not aligned.
    s.x[i] = (0.8F * f.u[i] - 0.6F * f.v[i]) * texels_per_m + shift_v;
    s.y[i] = (0.6F * f.u[i] + 0.8F * f.v[i]) * texels_per_m + shift_u;
    s.width[i] = f.width[i] * texels_per_m;
    s.weight[i] = 1.0F;
  }
}

/// Computes noise with cells from 1.2 cm to 4 m, except those below the filter width.
void grain(const Footprints& f, int n, uint32_t seed, Lane& noise) {
  static const NoiseTile tile(1, 16, 1);
  const float shift_u = static_cast<float>(seed & 255U), shift_v = static_cast<float>(seed >> 8 & 255U);
  const int whole = wide::whole(n);
  const float most = *std::max_element(f.count.at, f.count.at + n);
  std::fill_n(noise.at, whole, 0.0F);
  NoiseSamples s;
  for (int which = 0; static_cast<float>(which) < most; ++which) {
    fine_samples(f, whole, which, shift_u, shift_v, s);
    tile.add_means(s.x.at, s.y.at, s.width.at, s.weight.at, n, noise.at);
  }
  coarse_samples(f, whole, shift_u, shift_v, s);
  tile.add_means(s.x.at, s.y.at, s.width.at, s.weight.at, n, noise.at);
}

SEXTANT_SIMD void tint(const Eigen::Vector3f& colour, const Lane& shade, int n, Colours& c) {
  const float red = colour.x(), green = colour.y(), blue = colour.z();
  for (int i = 0; i < n; ++i) {
    c.red[i] = red * shade[i];
    c.green[i] = green * shade[i];
    c.blue[i] = blue * shade[i];
  }
}

/// A plain colour, made lighter and darker by noise.
SEXTANT_SIMD void plain(float mean, float contrast, float darkest, int n, Lane& noise_to_shade) {
  for (int i = 0; i < n; ++i) noise_to_shade[i] = max(darkest, mean + contrast * noise_to_shade[i]);
}

/// Smooth noise in [-1, 1) with one random value per cell of 1.7 m; its zero crossings are cracks.
SEXTANT_SIMD void asphalt(const Footprints& f, uint32_t seed, int n, Lane& noise_to_shade) {
  constexpr float texels_per_m = 1.0F / 1.7F;
  for (int i = 0; i < n; ++i) {
    const float x = f.u[i] * texels_per_m, y = f.v[i] * texels_per_m;
    const int32_t ix = floor_int(x), iy = floor_int(y);
    float a = x - static_cast<float>(ix), b = y - static_cast<float>(iy);
    a = a * a * (3 - 2 * a);
    b = b * b * (3 - 2 * b);
    const auto value = [&](int32_t dx, int32_t dy) {
      return unit(cell_bits(ix + dx, iy + dy, seed) & 0xffffU) * 2 - 1;
    };
    const float crack = mix(mix(value(0, 0), value(1, 0), a), mix(value(0, 1), value(1, 1), a), b);
    const float crack_width = 0.02F + f.width[i] * texels_per_m;
    const float dark = max(0.0F, 1.0F - wide::abs(crack) / crack_width) * 0.02F / crack_width;
    noise_to_shade[i] = max(0.2F, 1.0F + 0.16F * noise_to_shade[i] - 0.5F * dark);
  }
}

/// White paint of the road: a dashed middle line and solid lines at its sides.
SEXTANT_SIMD void road_lines(const Footprints& f, float side, int n, Lane& white) {
  for (int i = 0; i < n; ++i) {
    const float u = f.u[i], width = f.width_u[i];
    white[i] = cover(u, width, -0.07F, 0.07F) * cover_periodic(f.v[i], f.width_v[i], 6.0F, 0.0F, 3.0F) +
               cover(u, width, -side - 0.07F, -side + 0.07F) + cover(u, width, side - 0.07F, side + 0.07F);
  }
}

SEXTANT_SIMD void crossing_bars(const Footprints& f, int n, Lane& white) {
  for (int i = 0; i < n; ++i) white[i] = cover_periodic(f.u[i], f.width_u[i], 1.0F, 0.25F, 0.75F);
}

/// Blends white paint, worn in places, over the road's surface.
SEXTANT_SIMD void put_white(const Lane& white, const Lane& noise, int n, Colours& c) {
  for (int i = 0; i < n; ++i) {
    const float share = clamp(white[i] * (0.8F + 0.15F * noise[i]), 0.0F, 1.0F);
    c.red[i] = mix(c.red[i], 0.85F, share);
    c.green[i] = mix(c.green[i], 0.85F, share);
    c.blue[i] = mix(c.blue[i], 0.82F, share);
  }
}

/// Slabs of varying brightness, and the joints between them.
SEXTANT_SIMD void paving(const Footprints& f, uint32_t seed, int n, Lane& noise_to_shade) {
  for (int i = 0; i < n; ++i) {
    const float joint = max(cover_periodic(f.u[i], f.width_u[i], 0.6F, 0.0F, 0.025F),
                            cover_periodic(f.v[i], f.width_v[i], 0.6F, 0.0F, 0.025F));
    const float sharp = clamp(0.6F / max(f.width_u[i], f.width_v[i]) - 1.0F, 0.0F, 1.0F);
    const int32_t slab_u = floor_int(f.u[i] * (1 / 0.6F)), slab_v = floor_int(f.v[i] * (1 / 0.6F));
    const float slab = sharp * (unit(cell_bits(slab_u, slab_v, seed) & 0xffffU) * 2 - 1);
    noise_to_shade[i] = max(0.15F, 1.0F + 0.10F * slab + 0.15F * noise_to_shade[i] - 0.45F * joint);
  }
}

/// Courses of stone.
SEXTANT_SIMD void masonry(const Footprints& f, const Lane& noise, int n, Lane& shade) {
  for (int i = 0; i < n; ++i) {
    const float joint = max(cover_periodic(f.v[i], f.width_v[i], 0.31F, 0.0F, 0.03F),
                            0.6F * cover_periodic(f.u[i], f.width_u[i], 0.9F, 0.0F, 0.03F));
    shade[i] = max(0.2F, 1.0F + 0.15F * noise[i] - 0.30F * joint);
  }
}

/// Shares in [0, 1] of each sample that sills, frames and panes cover, and the colour of the panes.
struct Windows {
  Lane sill, frame, pane, red, green, blue;
};

SEXTANT_SIMD void window_shares(const Footprints& f, int n, Windows& w) {
  constexpr float bay_m = 2.7F, storey_m = 3.1F;
  for (int i = 0; i < n; ++i) {
    const float u = f.u[i], v = f.v[i], width_u = f.width_u[i], width_v = f.width_v[i];
    w.frame[i] =
        cover_periodic(u, width_u, bay_m, 0.65F, 2.05F) * cover_periodic(v, width_v, storey_m, 0.85F, 2.55F);
    w.pane[i] = min(1.0F, (cover_periodic(u, width_u, bay_m, 0.73F, 1.31F) +
                           cover_periodic(u, width_u, bay_m, 1.39F, 1.97F)) *
                              cover_periodic(v, width_v, storey_m, 0.93F, 2.47F));
    w.sill[i] = min(1.0F, cover_periodic(u, width_u, bay_m, 0.5F, 2.2F) *
                              cover_periodic(v, width_v, storey_m, 0.70F, 0.85F));
  }
}

/// Gives every window its own darkness and curtain.
SEXTANT_SIMD void window_light(const Footprints& f, const Lane& noise, uint32_t seed, int n, Windows& w) {
  constexpr float bay_m = 2.7F, storey_m = 3.1F;
  for (int i = 0; i < n; ++i) {
    const int32_t bay = floor_int(f.u[i] * (1 / bay_m)), storey = floor_int(f.v[i] * (1 / storey_m));
    const float sharp = clamp(bay_m / max(f.width_u[i], f.width_v[i]) - 1.0F, 0.0F, 1.0F);
    const uint32_t bits = cell_bits(bay, storey, seed);
    const float lit = 1.2F + 0.5F * sharp * (unit(bits & 0xffffU) * 2 - 1);
    const float blind = 2.47F - 1.2F * unit(bits >> 16);
    const float height = f.v[i] - static_cast<float>(storey) * storey_m;
    const float bright = sharp * cover(height, f.width_v[i], blind, 2.47F) * 0.55F + 0.10F * noise[i];
    w.red[i] = max(0.03F, 0.14F * lit + bright);
    w.green[i] = max(0.03F, 0.18F * lit + bright);
    w.blue[i] = max(0.03F, 0.23F * lit + bright);
  }
}

SEXTANT_SIMD void put_windows(const Footprints& f, const Windows& w, const Lane& shade,
                              const Eigen::Vector3f& colour, int n, Colours& c) {
  const float red = colour.x(), green = colour.y(), blue = colour.z();
  for (int i = 0; i < n; ++i) {
    const float ground_floor = cover(f.v[i], f.width_v[i], 0.0F, 0.8F);
    const auto over = [&](float wall, float sill, float frame, float glass) {
      const float front = mix(mix(mix(wall, sill, w.sill[i]), frame, w.frame[i]), glass, w.pane[i]);
      return mix(front, wall * 0.6F, ground_floor);
    };
    c.red[i] = over(red * shade[i], 0.72F, 0.82F, w.red[i]);
    c.green[i] = over(green * shade[i], 0.70F, 0.81F, w.green[i]);
    c.blue[i] = over(blue * shade[i], 0.66F, 0.78F, w.blue[i]);
  }
}

void facade(const Look& look, const Footprints& f, int n, const Lane& noise, Colours& c) {
  Lane shade;
  Windows w;
  masonry(f, noise, n, shade);
  window_shares(f, n, w);
  window_light(f, noise, look.seed, n, w);
  put_windows(f, w, shade, look.colour, n, c);
}

SEXTANT_SIMD void seams(const Footprints& f, int n, Lane& noise_to_shade) {
  for (int i = 0; i < n; ++i) {
    const float seam = cover_periodic(f.u[i] + 0.35F, f.width_u[i], 1.05F, 0.0F, 0.02F) +
                       cover(f.v[i], f.width_v[i], 0.66F, 0.68F);
    noise_to_shade[i] = max(0.1F, 1.0F + 0.07F * noise_to_shade[i] - 0.5F * min(1.0F, seam));
  }
}

SEXTANT_SIMD void measure_all(Footprints& f, int n) {
  for (int i = 0; i < n; ++i) {
    const float along_x = std::sqrt(f.u_x[i] * f.u_x[i] + f.v_x[i] * f.v_x[i]);
    const float along_y = std::sqrt(f.u_y[i] * f.u_y[i] + f.v_y[i] * f.v_y[i]);
    const bool x_longer = along_x > along_y;
    const float major_m = x_longer ? along_x : along_y;
    const float minor_m = max(x_longer ? along_y : along_x, 1e-6F);
    const float ratio = min(major_m / minor_m * 0.7F, max_samples - 1.0F);
    const auto count = static_cast<float>(static_cast<int32_t>(ratio) + 1);
    f.count[i] = count;
    f.along_u[i] = x_longer ? f.u_x[i] : f.u_y[i];
    f.along_v[i] = x_longer ? f.v_x[i] : f.v_y[i];
    f.width_u[i] = max(wide::abs(f.u_x[i]), wide::abs(f.u_y[i]));
    f.width_v[i] = max(wide::abs(f.v_x[i]), wide::abs(f.v_y[i]));
    f.width[i] = max(major_m / count, minor_m);
  }
}

/// Clouds on a high plane.
SEXTANT_SIMD void cloud_places(Footprints& f, int n, Lane& up) {
  for (int i = 0; i < n; ++i) {
    const float x = f.u[i], y = f.v[i], z = f.u_x[i];
    const float per_length = 1.0F / std::sqrt(x * x + y * y + z * z);
    const float rise = -y * per_length;
    const float height = 1.0F / max(rise, 0.02F);
    up[i] = clamp(rise, 0.0F, 1.0F);
    f.u[i] = x * per_length * height;
    f.v[i] = z * per_length * height;
    f.width[i] = 0.10F + 0.004F * height * height;
    f.count[i] = 1;
    f.along_u[i] = 0;
    f.along_v[i] = 0;
  }
}

SEXTANT_SIMD void clouds(const Lane& up, const Lane& noise, int n, Colours& c) {
  for (int i = 0; i < n; ++i) {
    const float blue = std::sqrt(up[i]);
    const float cloud = clamp(0.25F + 0.45F * noise[i], 0.0F, 0.8F);
    c.red[i] = mix(mix(0.80F, 0.30F, blue), 0.95F, cloud);
    c.green[i] = mix(mix(0.86F, 0.50F, blue), 0.95F, cloud);
    c.blue[i] = mix(mix(0.93F, 0.80F, blue), 0.96F, cloud);
  }
}

/// Parameters of materials without a pattern: mean, contrast, darkest shade.
struct Plain {
  float mean, contrast, darkest;
};

Plain plain_of(Material material) {
  if (material == Material::grass) return {1.0F, 0.20F, 0.15F};
  if (material == Material::foliage) return {0.85F, 0.50F, 0.1F};
  if (material == Material::bark) return {1.0F, 0.22F, 0.2F};
  if (material == Material::glass) return {1.0F, 0.18F, 0.2F};
  return {1.0F, 0.13F, 0.2F};
}

}  // namespace

void Footprints::measure(int n) { measure_all(*this, wide::whole(n)); }

void surface_colours(const Look& look, const Footprints& f, int n, Colours& c) {
  SEXTANT_CHECK(n > 0 && n <= batch);
  const int whole = wide::whole(n);
  Lane noise, shade;
  grain(f, n, look.seed, noise);
  shade = noise;
  switch (look.material) {
    case Material::asphalt:
    case Material::road:
    case Material::stripes:
      asphalt(f, look.seed, whole, shade);
      break;
    case Material::paving:
      paving(f, look.seed, whole, shade);
      break;
    case Material::facade:
      facade(look, f, whole, noise, c);
      return;
    case Material::paint:
      seams(f, whole, shade);
      break;
    default: {
      const Plain p = plain_of(look.material);
      plain(p.mean, p.contrast, p.darkest, whole, shade);
    }
  }
  tint(look.colour, shade, whole, c);
  if (look.material != Material::road && look.material != Material::stripes) return;
  Lane lines;
  if (look.material == Material::road) {
    road_lines(f, look.extent, whole, lines);
  } else {
    crossing_bars(f, whole, lines);
  }
  put_white(lines, noise, whole, c);
}

void sky_colours(Footprints& directions, int n, Colours& c) {
  const int whole = wide::whole(n);
  Lane up, noise;
  cloud_places(directions, whole, up);
  grain(directions, n, 4711, noise);
  clouds(up, noise, whole, c);
}

}  // namespace sextant::synthetic
