#include "sextant/datasets/synthetic/painter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sextant/datasets/synthetic/shading.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Places in a pixel: a square turned by an eighth.
constexpr int kSamples = 4;
constexpr std::array<std::array<double, 2>, kSamples> kPlaces = {
    {{-0.125, -0.375}, {0.375, -0.125}, {0.125, 0.375}, {-0.375, 0.125}}};

/// Display curve: a little contrast, highlights roll off.
class ToneCurve {
 public:
  ToneCurve() {
    for (int i = 0; i < kSize; ++i) {
      const float x = (static_cast<float>(i) + 0.5F) / kPerUnit;
      const float curved = x / (x + 0.35F) * 1.28F;
      bytes_[i] = static_cast<uint8_t>(std::min(255.0F * curved + 0.5F, 255.0F));
    }
  }
  Rgb operator()(const Vector3f& colour) const {
    return {byte(colour.x()), byte(colour.y()), byte(colour.z())};
  }

 private:
  static constexpr int kSize = 8192;
  static constexpr float kPerUnit = 4096;
  uint8_t byte(float value) const {
    return bytes_[std::clamp(static_cast<int>(value * kPerUnit), 0, kSize - 1)];
  }
  std::array<uint8_t, kSize> bytes_{};
};

enum Sun : uint8_t { lit = 0, shadowed = 1, turned_away = 2, unknown = 3 };

class Painter {
 public:
  Painter(const Bodies& bodies, const ShadowCasters& casters, const View& view, const PinholeCamera& camera)
      : bodies_(bodies),
        view_(view),
        camera_(camera),
        to_sun_(view.T_world_camera.rotation().conjugate() * to_sun()),
        sun_rays_(casters, view.T_camera_body, to_sun_),
        shader_(bodies, view, camera),
        width_(view.seen.width()),
        height_(view.seen.height()) {}

  Image<Rgb> paint() {
    find_shadows();
    for (int i = 0; i < kSamples; ++i) samples_[i] = view_.surfaces.seen(kPlaces[i][0], kPlaces[i][1]);
    Image<Rgb> image(width_, height_);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        if (on_edge(x, y)) {
          edges_.push_back({x, y});
        } else {
          image(x, y) = tone(shader_.colour(view_.seen(x, y), sun_(x, y) != lit, camera_.ray(x, y)));
        }
      }
    }
    paint_edges(image);
    return image;
  }

 private:
  struct Pixel {
    int x, y;
  };
  /// A pixel's sample whose shadow is not known from its neighbours.
  struct Ray {
    size_t edge;
    int sample;
  };

  static Rgb tone(const Vector3f& colour) {
    static const ToneCurve curve;
    return curve(colour);
  }
  Vector3d sample_ray(const Pixel& p, int i) const {
    return camera_.ray(p.x + kPlaces[i][0], p.y + kPlaces[i][1]);
  }
  const Patch* patch(uint32_t surface) const {
    return &bodies_.mesh(bodies_.body_of(surface)).patches[bodies_.triangle(surface).patch];
  }
  /// Two surfaces that look the same side by side.
  bool same_look(uint32_t a, uint32_t b) const {
    if (a == b) return true;
    if (a == Bodies::kSky || b == Bodies::kSky) return false;
    return patch(a) == patch(b);
  }

  // ---- shadows

  /// A point just off the surface, towards the camera; empty when the surface is turned away from the sun.
  std::optional<Vector3f> shadow_origin(uint32_t surface, const Vector3d& ray) const {
    Vector3d normal = view_.surfaces.normal(surface);
    if (normal.dot(ray) > 0) normal = -normal;
    if (normal.dot(to_sun_) <= 0) return std::nullopt;
    const double depth_m = view_.surfaces.depth_m(surface, ray);
    return (depth_m * ray + (0.003 + 1e-4 * depth_m) * normal).cast<float>();
  }

  /// At every second pixel of every second row first; where those around agree, the others follow them.
  void find_shadows() {
    sun_ = Image<uint8_t>(width_, height_, unknown);
    std::vector<Pixel> ask;
    const auto want = [&](int x, int y) {
      if (view_.seen(x, y) == Bodies::kSky) {
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

  bool on_edge(int x, int y) const {
    const uint32_t own = view_.seen(x, y);
    const bool own_lit = sun_(x, y) == lit;
    const auto differs = [&](int i, int j) {
      const uint32_t other = view_.seen(i, j);
      if ((sun_(i, j) == lit) != own_lit) return true;
      if (other == own) return false;
      return !same_look(own, other) || folds(own, other, x, y);
    };
    for (const Image<uint32_t>& sample : samples_) {
      const uint32_t other = sample(x, y);
      if (other != own && (!same_look(own, other) || folds(own, other, x, y))) return true;
    }
    return (x > 0 && differs(x - 1, y)) || (x + 1 < width_ && differs(x + 1, y)) ||
           (y > 0 && differs(x, y - 1)) || (y + 1 < height_ && differs(x, y + 1));
  }

  /// One part of a curved patch before another, or at an angle to it.
  bool folds(uint32_t a, uint32_t b, int x, int y) const {
    const Vector3d ray = camera_.ray(x, y);
    if (patch(a)->look.material == Material::foliage) {
      const double za = view_.surfaces.depth_m(a, ray), zb = view_.surfaces.depth_m(b, ray);
      return std::abs(za - zb) > 0.04 * std::min(za, zb);
    }
    return std::abs(view_.surfaces.normal(a).dot(view_.surfaces.normal(b))) < 0.97;
  }

  void paint_edges(Image<Rgb>& image) {
    std::vector<std::array<uint8_t, kSamples>> states(edges_.size());
    std::vector<Vector3f> points;
    std::vector<Ray> rays;
    for (size_t e = 0; e < edges_.size(); ++e) {
      for (int i = 0; i < kSamples; ++i) {
        const uint32_t surface = samples_[i](edges_[e].x, edges_[e].y);
        states[e][i] = surface == Bodies::kSky ? uint8_t{lit} : near_state(edges_[e], surface);
        if (states[e][i] != unknown) continue;
        const auto origin = shadow_origin(surface, sample_ray(edges_[e], i));
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
    for (size_t e = 0; e < edges_.size(); ++e) {
      image(edges_[e].x, edges_[e].y) = tone(mean_colour(edges_[e], states[e]));
    }
  }

  /// The shadow of the neighbours that show the same triangle, when they agree.
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

  /// Textures are filtered already: every look in the pixel is shaded once.
  Vector3f mean_colour(const Pixel& p, const std::array<uint8_t, kSamples>& states) {
    std::array<Vector3f, kSamples> colours;
    Vector3f sum = Vector3f::Zero();
    for (int i = 0; i < kSamples; ++i) {
      const uint32_t surface = samples_[i](p.x, p.y);
      int same = 0;
      while (same < i && (samples_[same](p.x, p.y) != surface || (states[same] == lit) != (states[i] == lit)))
        ++same;
      colours[i] = same < i ? colours[same]
                            : shader_.colour(surface, states[i] != lit, sample_ray(p, i)).cwiseMin(1.5F);
      sum += colours[i];
    }
    return sum / static_cast<float>(kSamples);
  }

  const Bodies& bodies_;
  const View& view_;
  const PinholeCamera& camera_;
  Vector3d to_sun_;  ///< camera coordinates
  SunRays sun_rays_;
  Shader shader_;
  int width_, height_;
  Image<uint8_t> sun_;
  std::array<Image<uint32_t>, kSamples> samples_;
  std::vector<Pixel> edges_;
};

}  // namespace

Image<Rgb> paint(const Bodies& bodies, const ShadowCasters& casters, const View& view,
                 const PinholeCamera& camera) {
  return Painter(bodies, casters, view, camera).paint();
}

}  // namespace sextant::synthetic
