
#include <algorithm>
#include <array>
#include <cmath>

#include "sextant/datasets/synthetic/shading.h"
#include "sextant/datasets/synthetic/wide.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Sample positions in a pixel: a triangle around its centre, rotated so that no two share a row or column.
constexpr int n_samples = 3;
constexpr std::array<std::array<double, 2>, n_samples> places = {
    {{0.066, -0.374}, {0.291, 0.244}, {-0.357, 0.130}}};

/// Applies the display curve: slightly higher contrast, compressed highlights. Red is the lowest byte.
SEXTANT_SIMD void tone(const Colours& c, int n, uint32_t* __restrict packed) {
  const auto byte = [](float value) {
    const float x = wide::max(value, 0.0F);
    return static_cast<uint32_t>(
        static_cast<int32_t>(wide::min(x / (x + 0.35F) * (1.28F * 255.0F), 255.0F) + 0.5F));
  };
  for (int i = 0; i < n; ++i) packed[i] = byte(c.red[i]) | byte(c.green[i]) << 8 | byte(c.blue[i]) << 16;
}

Rgb unpacked(uint32_t packed) {
  return {static_cast<uint8_t>(packed), static_cast<uint8_t>(packed >> 8),
          static_cast<uint8_t>(packed >> 16)};
}

/// Marks pixels of a row whose surface or light differs from a neighbour's; not the first and the last.
SEXTANT_SIMD void mark_row(const std::array<const uint32_t*, 3>& seen,
                           const std::array<const uint8_t*, 3>& sun, int width, uint8_t* __restrict marked) {
  const uint32_t* up = seen[0];
  const uint32_t* own = seen[1];
  const uint32_t* down = seen[2];
  for (int x = 1; x < width - 1; ++x) {
    const uint32_t s = own[x];
    const uint32_t others = (own[x - 1] ^ s) | (own[x + 1] ^ s) | (up[x] ^ s) | (down[x] ^ s) |
                            (up[x - 1] ^ s) | (up[x + 1] ^ s) | (down[x - 1] ^ s) | (down[x + 1] ^ s);
    marked[x] = others != 0 ? 1 : 0;
  }
  for (int x = 1; x < width - 1; ++x) {
    const uint8_t s = sun[1][x];
    const auto others =
        static_cast<uint8_t>((sun[1][x - 1] ^ s) | (sun[1][x + 1] ^ s) | (sun[0][x] ^ s) | (sun[2][x] ^ s));
    marked[x] = static_cast<uint8_t>(marked[x] | others);
  }
}

enum Sun : uint8_t { lit = 0, shadowed = 1, turned_away = 2, unknown = 3 };

class Painter final : private Shader::Sink {
 public:
  Painter(const Bodies& bodies, const ShadowCasters& casters, const View& view, const PinholeCamera& camera)
      : bodies_(bodies),
        view_(view),
        camera_(camera),
        to_sun_(view.T_world_camera.rotation().conjugate() * to_sun()),
        sun_rays_(casters, view.T_camera_body, to_sun_),
        width_(view.seen.width()),
        height_(view.seen.height()),
        image_(width_, height_) {}

  Image<Rgb> paint() {
    find_shadows();
    find_edges();
    split_edges();
    shade();
    tone_edges();
    return std::move(image_);
  }

 private:
  /// A pixel on an edge, and the surfaces at its samples.
  struct Edge {
    Pixel pixel;
    std::array<uint32_t, n_samples> surfaces;
  };
  /// Samples of an edge with the same look: one of them, and their share of the pixel.
  struct Part {
    uint32_t surface, edge;
    float x, y, sun, share;
  };
  /// A sample whose shadow does not follow from its neighbours.
  struct Ray {
    size_t edge;
    int sample;
  };

  Vector3d sample_ray(const Pixel& p, int i) const {
    return camera_.ray(p.x + places[i][0], p.y + places[i][1]);
  }
  /// Returns true if two surfaces have the same look.
  bool same_look(uint32_t a, uint32_t b) const {
    if (a == b) return true;
    if (a == Bodies::sky_surface || b == Bodies::sky_surface) return false;
    return &bodies_.patch(a) == &bodies_.patch(b);
  }

  // ---- shadows

  /// Returns a point just off the surface, towards the camera; nullopt if the surface faces away from the
  /// sun.
  std::optional<Vector3f> shadow_origin(uint32_t surface, const Vector3d& ray) const {
    Vector3d normal = view_.surfaces.normal(surface);
    if (normal.dot(ray) > 0) normal = -normal;
    if (normal.dot(to_sun_) <= 0) return std::nullopt;
    const double depth_m = view_.surfaces.depth_m(surface, ray);
    return (depth_m * ray + (0.003 + 1e-4 * depth_m) * normal).cast<float>();
  }

  /// Computes shadows at every second pixel of every second row first. A pixel in between takes the value of
  /// these neighbours if they agree and show the same look as the pixel.
  void find_shadows() {
    sun_ = Image<uint8_t>(width_, height_, unknown);
    std::vector<Pixel> ask;
    const auto want = [&](int x, int y) {
      if (view_.seen(x, y) == Bodies::sky_surface) {
        sun_(x, y) = lit;
      } else {
        ask.push_back({x, y});
      }
    };
    for (int y = 0; y < height_; y += 2) {
      for (int x = 0; x < width_; x += 2) want(x, y);
    }
    ask_sun(ask);
    ask.clear();
    for (int y = 0; y < height_; ++y) {
      for (int x = 1 - y % 2; x < width_; x += 1 + (y + 1) % 2) {
        const uint8_t known = from_grid(x, y);
        if (known == unknown) {
          want(x, y);
        } else {
          sun_(x, y) = known;
        }
      }
    }
    ask_sun(ask);
  }

  uint8_t from_grid(int x, int y) const {
    const int x0 = x - x % 2, y0 = y - y % 2;
    const int x1 = x % 2 != 0 ? x0 + 2 : x0, y1 = y % 2 != 0 ? y0 + 2 : y0;
    if (x1 >= width_ || y1 >= height_) return unknown;
    const uint8_t state = sun_(x0, y0);
    for (const auto& [i, j] : {std::pair(x0, y0), {x1, y0}, {x0, y1}, {x1, y1}}) {
      if (sun_(i, j) != state || !same_look(view_.seen(x, y), view_.seen(i, j))) return unknown;
    }
    return state;
  }

  void ask_sun(const std::vector<Pixel>& pixels) {
    std::vector<Vector3f> points;
    std::vector<Pixel> asked;
    for (const Pixel& p : pixels) {
      if (const auto origin = shadow_origin(view_.seen(p.x, p.y), camera_.ray(p.x, p.y))) {
        points.push_back(*origin);
        asked.push_back(p);
      } else {
        sun_(p.x, p.y) = turned_away;
      }
    }
    std::vector<uint8_t> answers(points.size());
    sun_rays_.cast(points, answers);
    for (size_t i = 0; i < asked.size(); ++i) {
      sun_(asked[i].x, asked[i].y) = answers[i] != 0 ? shadowed : lit;
    }
  }

  // ---- edges

  /// Returns the pixels with a change, including those on edges.
  Image<uint8_t> changes() const {
    Image<uint8_t> marked(width_, height_, 1);  // the first and the last of each row stay 1
    for (int y = 0; y < height_; ++y) {
      const int above = std::max(y - 1, 0), below = std::min(y + 1, height_ - 1);
      mark_row({view_.seen.row(above), view_.seen.row(y), view_.seen.row(below)},
               {sun_.row(above), sun_.row(y), sun_.row(below)}, width_, marked.row(y));
    }
    return marked;
  }

  void find_edges() {
    on_edge_ = changes();
    const Spots spots(on_edge_);
    std::array<std::vector<uint32_t>, n_samples> samples;
    for (int i = 0; i < n_samples; ++i) {
      samples[i] = view_.surfaces.seen_at(spots, places[i][0], places[i][1]);
    }
    for (int y = 0; y < height_; ++y) {
      for (uint32_t spot = spots.first(y); spot < spots.first(y + 1); ++spot) {
        Edge edge{{static_cast<int>(spots.x()[spot]), y}, {}};
        for (int i = 0; i < n_samples; ++i) edge.surfaces[i] = samples[i][spot];
        const bool is_edge = on_edge(edge);
        on_edge_(edge.pixel.x, y) = is_edge ? 1 : 0;
        if (is_edge) edges_.push_back(edge);
      }
    }
  }

  bool on_edge(const Edge& edge) const {
    const auto x = edge.pixel.x, y = edge.pixel.y;
    const uint32_t own = view_.seen(x, y);
    const bool own_lit = sun_(x, y) == lit;
    const auto breaks = [&](uint32_t other) {
      return other != own && (!same_look(own, other) || folds(own, other, x, y));
    };
    const auto differs = [&](int i, int j) {
      return (sun_(i, j) == lit) != own_lit || breaks(view_.seen(i, j));
    };
    return std::ranges::any_of(edge.surfaces, breaks) || (x > 0 && differs(x - 1, y)) ||
           (x + 1 < width_ && differs(x + 1, y)) || (y > 0 && differs(x, y - 1)) ||
           (y + 1 < height_ && differs(x, y + 1));
  }

  /// Returns true if one part of a curved patch is in front of the other, or at an angle to it.
  bool folds(uint32_t a, uint32_t b, int x, int y) const {
    const Vector3d ray = camera_.ray(x, y);
    if (bodies_.patch(a).look.material == Material::foliage) {
      const double za = view_.surfaces.depth_m(a, ray), zb = view_.surfaces.depth_m(b, ray);
      return std::abs(za - zb) > 0.04 * std::min(za, zb);
    }
    return std::abs(view_.surfaces.normal(a).dot(view_.surfaces.normal(b))) < 0.97;
  }

  /// Splits edges into parts. Textures are already filtered, so every look in a pixel is shaded once.
  void split_edges() {
    const auto states = edge_states();
    for (uint32_t e = 0; e < edges_.size(); ++e) {
      const auto& [pixel, surfaces] = edges_[e];
      std::array<bool, n_samples> done{};
      for (int i = 0; i < n_samples; ++i) {
        if (done[i]) continue;
        const bool is_lit = states[e][i] == lit;
        int n = 0;
        for (int j = i; j < n_samples; ++j) {
          if (surfaces[j] != surfaces[i] || (states[e][j] == lit) != is_lit) continue;
          done[j] = true;
          ++n;
        }
        parts_.push_back({surfaces[i], e, static_cast<float>(pixel.x + places[i][0]),
                          static_cast<float>(pixel.y + places[i][1]), is_lit ? 1.0F : 0.0F,
                          static_cast<float>(n) / n_samples});
      }
    }
  }

  /// Returns for every sample of every edge whether the sun shines on it.
  std::vector<std::array<uint8_t, n_samples>> edge_states() const {
    std::vector<std::array<uint8_t, n_samples>> states(edges_.size());
    std::vector<Vector3f> points;
    std::vector<Ray> rays;
    for (size_t e = 0; e < edges_.size(); ++e) {
      for (int i = 0; i < n_samples; ++i) {
        const uint32_t surface = edges_[e].surfaces[i];
        states[e][i] = surface == Bodies::sky_surface ? uint8_t{lit} : near_state(edges_[e].pixel, surface);
        if (states[e][i] != unknown) continue;
        const auto origin = shadow_origin(surface, sample_ray(edges_[e].pixel, i));
        states[e][i] = shadowed;
        if (!origin) continue;
        points.push_back(*origin);
        rays.push_back({e, i});
      }
    }
    std::vector<uint8_t> answers(points.size());
    sun_rays_.cast(points, answers);
    for (size_t i = 0; i < rays.size(); ++i) {
      states[rays[i].edge][rays[i].sample] = answers[i] != 0 ? shadowed : lit;
    }
    return states;
  }

  /// Returns the shadow of this pixel and its neighbours, as far as they show the same triangle; unknown if
  /// there is none or they disagree.
  uint8_t near_state(const Pixel& p, uint32_t surface) const {
    uint8_t state = unknown;
    for (const auto& [dx, dy] : {std::pair(0, 0), {-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      const int x = p.x + dx, y = p.y + dy;
      if (x < 0 || y < 0 || x >= width_ || y >= height_ || view_.seen(x, y) != surface) continue;
      if (state != unknown && sun_(x, y) != state) return unknown;
      state = sun_(x, y);
    }
    return state;
  }

  // ---- colours

  /// Calls function(surface, x, y, sun, target) for every pixel off the edges and every part of an edge.
  template <typename Function>
  void each_sample(const Function& function) const {
    for (int y = 0; y < height_; ++y) {
      const uint32_t* seen = view_.seen.row(y);
      const uint8_t* edge = on_edge_.row(y);
      const uint8_t* sun = sun_.row(y);
      for (int x = 0; x < width_; ++x) {
        if (edge[x] != 0) continue;
        function(seen[x], static_cast<float>(x), static_cast<float>(y), sun[x] == lit ? 1.0F : 0.0F,
                 static_cast<uint32_t>(y * width_ + x));
      }
    }
    for (uint32_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      function(part.surface, part.x, part.y, part.sun, part_vertices | i);
    }
  }

  /// Sorts the samples by surface, and shades one surface after the other.
  void shade() {
    const uint32_t sky = bodies_.n_surfaces();
    const auto key = [&](uint32_t surface) { return std::min(surface, sky); };
    std::vector<uint32_t> ends(sky + 2, 0);
    each_sample([&](uint32_t surface, float, float, float, uint32_t) { ++ends[key(surface) + 1]; });
    for (uint32_t i = 0; i <= sky; ++i) ends[i + 1] += ends[i];
    const size_t n = ends[sky + 1];
    std::vector<float> xs(n), ys(n), suns(n);
    std::vector<uint32_t> targets(n);
    each_sample([&](uint32_t surface, float x, float y, float sun, uint32_t target) {
      const uint32_t at = ends[key(surface)]++;  // begins as the surface's start and ends as its end
      xs[at] = x;
      ys[at] = y;
      suns[at] = sun;
      targets[at] = target;
    });
    sums_.resize(edges_.size());
    Shader shader(bodies_, view_, camera_, *this);
    for (uint32_t surface = 0, from = 0; surface <= sky; from = ends[surface++]) {
      const size_t count = ends[surface] - from;
      if (count == 0) continue;
      shader.shade(surface == sky ? Bodies::sky_surface : surface,
                   {{&xs[from], count}, {&ys[from], count}, {&suns[from], count}, {&targets[from], count}});
    }
    shader.flush();
  }

  void take(std::span<const uint32_t> targets, const Colours& colours) override {
    uint32_t packed[NoiseTile::batch];
    const auto n = static_cast<int>(targets.size());
    tone(colours, wide::whole(n), packed);
    for (int i = 0; i < n; ++i) {
      if ((targets[i] & part_vertices) == 0) {
        image_.data()[targets[i]] = unpacked(packed[i]);
        continue;
      }
      const Part& part = parts_[targets[i] ^ part_vertices];
      std::array<float, 3>& sum = sums_[part.edge];
      sum[0] += part.share * std::min(colours.red[i], brightest);
      sum[1] += part.share * std::min(colours.green[i], brightest);
      sum[2] += part.share * std::min(colours.blue[i], brightest);
    }
  }

  void tone_edges() {
    Colours colours;
    uint32_t packed[NoiseTile::batch];
    for (size_t from = 0; from < edges_.size(); from += NoiseTile::batch) {
      const auto n = static_cast<int>(std::min<size_t>(NoiseTile::batch, edges_.size() - from));
      for (int i = 0; i < n; ++i) {
        colours.red[i] = sums_[from + i][0];
        colours.green[i] = sums_[from + i][1];
        colours.blue[i] = sums_[from + i][2];
      }
      tone(colours, wide::whole(n), packed);
      for (int i = 0; i < n; ++i) {
        image_(edges_[from + i].pixel.x, edges_[from + i].pixel.y) = unpacked(packed[i]);
      }
    }
  }

  /// flag of a target: a part of an edge, not a pixel
  static constexpr uint32_t part_vertices = 0x80000000U;
  /// limit for a part, so that a highlight does not dominate the pixel
  static constexpr float brightest = 1.5F;

  const Bodies& bodies_;
  const View& view_;
  const PinholeCamera& camera_;
  Vector3d to_sun_;  ///< in camera coordinates
  SunRays sun_rays_;
  int width_, height_;
  Image<uint8_t> sun_;
  Image<uint8_t> on_edge_;
  std::vector<Edge> edges_;
  std::vector<Part> parts_;
  std::vector<std::array<float, 3>> sums_;  ///< colours of the edges
  Image<Rgb> image_;
};

}  // namespace

Image<Rgb> paint(const Bodies& bodies, const ShadowCasters& casters, const View& view,
                 const PinholeCamera& camera) {
  return Painter(bodies, casters, view, camera).paint();
}

}  // namespace sextant::synthetic
