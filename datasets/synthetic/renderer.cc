#include "sextant/datasets/synthetic/renderer.h"

#include <algorithm>
#include <cmath>

#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/synthetic/shading.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kNearestFlow_m = 0.1;

/// Eight places in a pixel, one in each row and column of an 8x8 grid; those near the centre first.
constexpr std::array<std::array<double, 2>, 8> kSubpixels = {{{-0.0625, 0.0625},
                                                              {0.1875, -0.1875},
                                                              {-0.1875, -0.3125},
                                                              {0.3125, 0.1875},
                                                              {-0.4375, -0.0625},
                                                              {-0.3125, 0.3125},
                                                              {0.0625, 0.4375},
                                                              {0.4375, -0.4375}}};

/// A half-open rectangle of pixels.
struct Window {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Where a mesh can be seen at most.
Window window_of(const Mesh& mesh, const SE3& T_camera_body, const PinholeCamera& camera) {
  constexpr double kNear_m = 0.1;
  double left = kWidth, top = kHeight, right = 0, bottom = 0;
  size_t n_behind = 0;
  for (const Vector3d& vertex : mesh.vertices) {
    const Vector3d p = T_camera_body * vertex;
    if (p.z() < kNear_m) {
      ++n_behind;
      continue;
    }
    const Eigen::Vector2d pixel = camera.project(p);
    left = std::min(left, pixel.x());
    right = std::max(right, pixel.x());
    top = std::min(top, pixel.y());
    bottom = std::max(bottom, pixel.y());
  }
  if (n_behind == mesh.vertices.size()) return {};
  if (n_behind > 0) return {0, 0, kWidth, kHeight};  // it crosses the camera's plane
  const auto clamp = [](double value, int high) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(high)));
  };
  return {clamp(left - 1, kWidth), clamp(top - 1, kHeight), clamp(right + 2, kWidth),
          clamp(bottom + 2, kHeight)};
}

uint8_t to_byte(float value) {
  // Display curve: a little contrast, highlights roll off.
  const float x = std::clamp(value, 0.0F, 4.0F);
  const float curved = x / (x + 0.35F) * 1.28F;
  return static_cast<uint8_t>(std::min(255.0F * curved + 0.5F, 255.0F));
}

Rgb to_rgb(const Vector3f& colour) { return {to_byte(colour.x()), to_byte(colour.y()), to_byte(colour.z())}; }

}  // namespace

struct Renderer::View {
  int frame = 0;
  SE3 T_world_camera;
  std::vector<SE3> T_camera_body;
  std::unique_ptr<RayScene> scene;
};

Renderer::Renderer(const std::string& scenario) : scenario_(make_scenario(scenario)) {
  std::vector<Mesh> meshes;
  meshes.push_back(make_street(scenario_.street));
  for (const Actor& actor : scenario_.actors) meshes.push_back(make_car(actor.shape));
  bodies_ = std::make_unique<Bodies>(std::move(meshes));
}

Renderer::View Renderer::view(int frame) const {
  SEXTANT_CHECK(frame >= 0 && frame < scenario_.n_frames());
  View out;
  out.frame = frame;
  out.T_world_camera = scenario_.T_world_camera[frame];
  const SE3 T_camera_world = out.T_world_camera.inverse();
  out.T_camera_body.push_back(T_camera_world);
  for (const Actor& actor : scenario_.actors) {
    out.T_camera_body.push_back(T_camera_world * actor.T_world_object[frame]);
  }
  out.scene = std::make_unique<RayScene>(*bodies_, out.T_camera_body, T_camera_world.rotation() * to_sun());
  return out;
}

Frame Renderer::render(int frame, const Channels& channels) const {
  Frame out;
  out.index = frame;
  if (!channels.gray && !channels.rgb && !channels.depth && !channels.flow && !channels.mask) return out;
  render_geometry(view(frame), out, channels);
  return out;
}

void Renderer::render_geometry(const View& view, Frame& out, const Channels& channels) const {
  const PinholeCamera pinhole = camera().left;
  const bool colours = channels.gray || channels.rgb;
  std::vector<Hit> hits(static_cast<size_t>(kWidth) * kHeight);
  RayScene::Directions rays;
  RayScene::Hits found;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; x += RayScene::kWidth) {
      const int n = std::min(RayScene::kWidth, kWidth - x);
      for (int i = 0; i < n; ++i) rays[i] = pinhole.ray(x + i, y);
      view.scene->cast(rays, n, colours, found);
      std::copy_n(found.begin(), n, hits.begin() + static_cast<ptrdiff_t>(y) * kWidth + x);
    }
  }
  if (colours) {
    out.rgb = render_rgb(view, hits);
    if (channels.gray) out.gray = rgb_to_gray(out.rgb);
    if (!channels.rgb) out.rgb = {};
  }
  if (channels.depth) {
    out.depth_m = Image<float>(kWidth, kHeight, NAN);
    for (size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].body != Hit::kNone) out.depth_m.data()[i] = static_cast<float>(hits[i].depth_m);
    }
  }
  if (channels.mask) {
    out.mask = Image<uint16_t>(kWidth, kHeight);
    for (size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].body == Hit::kNone || hits[i].body == 0) continue;
      out.mask.data()[i] = static_cast<uint16_t>(scenario_.actors[hits[i].body - 1].id);
    }
  }
  if (channels.flow && view.frame + 1 < scenario_.n_frames()) render_flow(view, hits, out);
}

Image<Rgb> Renderer::render_rgb(const View& view, const std::vector<Hit>& hits) const {
  const PinholeCamera pinhole = camera().left;
  const Shader shader(*bodies_, *view.scene, view.T_camera_body, view.T_world_camera, 1.0 / pinhole.fx);
  const auto patch_of = [&](const Hit& hit) { return bodies_->mesh(hit.body).triangles[hit.triangle].patch; };
  const auto curved = [&](const Hit& hit) { return bodies_->mesh(hit.body).patches[patch_of(hit)].curved; };
  const auto differ = [&](const Hit& a, const Hit& b) {
    if (a.body != b.body) return true;
    if (a.body == Hit::kNone) return false;
    if (a.shadowed != b.shadowed) return true;
    if (patch_of(a) == patch_of(b) && !curved(a)) return false;
    if (!curved(a) || !curved(b)) return true;
    return std::abs(a.depth_m - b.depth_m) > 0.04 * std::min(a.depth_m, b.depth_m);
  };
  Image<Rgb> image(kWidth, kHeight);
  RayScene::Directions rays;
  RayScene::Hits found;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Hit& hit = hits[static_cast<size_t>(y) * kWidth + x];
      bool edge = false;
      if (x > 0) edge |= differ(hit, *(&hit - 1));
      if (x + 1 < kWidth) edge |= differ(hit, *(&hit + 1));
      if (y > 0) edge |= differ(hit, *(&hit - kWidth));
      if (y + 1 < kHeight) edge |= differ(hit, *(&hit + kWidth));
      if (!edge) {
        image(x, y) = to_rgb(shader.colour(hit, pinhole.ray(x, y)));
        continue;
      }
      for (size_t i = 0; i < kSubpixels.size(); ++i) {
        rays[i] = pinhole.ray(x + kSubpixels[i][0], y + kSubpixels[i][1]);
      }
      view.scene->cast(rays, RayScene::kWidth, true, found);
      // Textures are filtered already: every surface in the pixel is shaded once, near the centre.
      std::array<Vector3f, RayScene::kWidth> colours;
      Vector3f sum = Vector3f::Zero();
      for (size_t i = 0; i < kSubpixels.size(); ++i) {
        const auto same = [&](const Hit& other) { return !differ(found[i], other); };
        const auto before = std::find_if(found.begin(), found.begin() + static_cast<ptrdiff_t>(i), same);
        const auto first = static_cast<size_t>(before - found.begin());
        colours[i] = first < i ? colours[first] : shader.colour(found[i], rays[i]).cwiseMin(1.5F);
        sum += colours[i];
      }
      image(x, y) = to_rgb(sum / static_cast<float>(kSubpixels.size()));
    }
  }
  return image;
}

void Renderer::render_flow(const View& view, const std::vector<Hit>& hits, Frame& out) const {
  const PinholeCamera pinhole = camera().left;
  const SE3 T_next_world = scenario_.T_world_camera[view.frame + 1].inverse();
  std::vector<SE3> T_next_curr;  // of each body's points
  for (size_t i = 0; i < view.T_camera_body.size(); ++i) {
    const SE3 T_next_body =
        i == 0 ? T_next_world : T_next_world * scenario_.actors[i - 1].T_world_object[view.frame + 1];
    T_next_curr.push_back(T_next_body * view.T_camera_body[i].inverse());
  }
  out.flow = Image<Flow>(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Hit& hit = hits[static_cast<size_t>(y) * kWidth + x];
      if (hit.body == Hit::kNone) continue;
      const auto stored_m = static_cast<double>(static_cast<float>(hit.depth_m));
      const Vector3d next = T_next_curr[hit.body] * pinhole.backproject(x, y, stored_m);
      if (next.z() < kNearestFlow_m) continue;
      const Eigen::Vector2d pixel = pinhole.project(next);
      out.flow(x, y) = {static_cast<float>(pixel.x() - x), static_cast<float>(pixel.y() - y)};
    }
  }
}

SequenceTruth Renderer::truth(int first, int last) const {
  const PinholeCamera pinhole = camera().left;
  SequenceTruth truth;
  for (int frame = first; frame <= last; ++frame) {
    truth.camera.set(frame, scenario_.T_world_camera[frame]);
    const View now = view(frame);
    for (size_t i = 0; i < scenario_.actors.size(); ++i) {
      const Actor& actor = scenario_.actors[i];
      const SE3& T_camera_object = now.T_camera_body[i + 1];
      const Window window = window_of(bodies_->mesh(i + 1), T_camera_object, pinhole);
      Window seen{kWidth, kHeight, -1, -1};
      RayScene::Directions rays;
      RayScene::Hits found;
      for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; x += RayScene::kWidth) {
          const int n = std::min(RayScene::kWidth, window.x1 - x);
          for (int k = 0; k < n; ++k) rays[k] = pinhole.ray(x + k, y);
          now.scene->cast(rays, n, false, found);
          for (int k = 0; k < n; ++k) {
            if (found[k].body != i + 1) continue;
            seen = {std::min(seen.x0, x + k), std::min(seen.y0, y), std::max(seen.x1, x + k),
                    std::max(seen.y1, y)};
          }
        }
      }
      if (seen.x1 < 0) continue;
      truth.objects[frame].push_back(
          {actor.id, T_camera_object, seen.x0, seen.y0, seen.x1, seen.y1, actor.moving, false});
    }
  }
  return truth;
}

}  // namespace sextant::synthetic
