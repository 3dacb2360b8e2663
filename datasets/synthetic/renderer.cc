#include "sextant/datasets/synthetic/renderer.h"

#include <algorithm>
#include <cmath>

#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/synthetic/shading.h"
#include "sextant/datasets/synthetic/view.h"

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

uint8_t to_byte(float value) {
  // Display curve: a little contrast, highlights roll off.
  const float x = std::clamp(value, 0.0F, 4.0F);
  const float curved = x / (x + 0.35F) * 1.28F;
  return static_cast<uint8_t>(std::min(255.0F * curved + 0.5F, 255.0F));
}

Rgb to_rgb(const Vector3f& colour) { return {to_byte(colour.x()), to_byte(colour.y()), to_byte(colour.z())}; }

}  // namespace

Renderer::Renderer(Scenario scenario) : scenario_(std::move(scenario)) {
  scenario_.check();
  std::vector<Mesh> meshes;
  meshes.push_back(scenario_.world);
  for (const Actor& actor : scenario_.actors) meshes.push_back(make_car(actor.shape));
  bodies_ = std::make_unique<Bodies>(std::move(meshes));
}

Renderer::View Renderer::view(int frame) const {
  SEXTANT_CHECK(frame >= 0 && frame < scenario_.n_frames());
  View out;
  out.frame = frame;
  out.T_world_camera = scenario_.T_world_camera[frame];
  const SE3 T_camera_world = out.T_world_camera.inverse();
  out.T_camera_body.emplace_back(T_camera_world);
  for (const Actor& actor : scenario_.actors) {
    const std::optional<SE3>& T_world_object = actor.T_world_object[frame];
    out.T_camera_body.push_back(T_world_object ? std::optional(T_camera_world * *T_world_object)
                                               : std::nullopt);
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
  const PinholeCamera pinhole = scenario_.camera.left;
  const bool colours = channels.gray || channels.rgb;
  std::vector<Hit> hits(static_cast<size_t>(scenario_.width) * scenario_.height);
  RayScene::Directions rays;
  RayScene::Hits found;
  for (int y = 0; y < scenario_.height; ++y) {
    for (int x = 0; x < scenario_.width; x += RayScene::kWidth) {
      const int n = std::min(RayScene::kWidth, scenario_.width - x);
      for (int i = 0; i < n; ++i) rays[i] = pinhole.ray(x + i, y);
      view.scene->cast(rays, n, colours, found);
      std::copy_n(found.begin(), n, hits.begin() + static_cast<ptrdiff_t>(y) * scenario_.width + x);
    }
  }
  if (colours) {
    out.rgb = render_rgb(view, hits);
    if (channels.gray) out.gray = rgb_to_gray(out.rgb);
    if (!channels.rgb) out.rgb = {};
  }
  if (channels.depth) {
    out.depth_m = Image<float>(scenario_.width, scenario_.height, NAN);
    for (size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].body != Hit::kNone) out.depth_m.data()[i] = static_cast<float>(hits[i].depth_m);
    }
  }
  if (channels.mask) {
    out.mask = Image<uint16_t>(scenario_.width, scenario_.height);
    for (size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].body == Hit::kNone || hits[i].body == 0) continue;
      out.mask.data()[i] = static_cast<uint16_t>(scenario_.actors[hits[i].body - 1].id);
    }
  }
  if (channels.flow && view.frame + 1 < scenario_.n_frames()) {
    out.flow = render_flow(view, hits, view.frame + 1);
  }
}

Image<Rgb> Renderer::render_rgb(const View& view, const std::vector<Hit>& hits) const {
  const PinholeCamera pinhole = scenario_.camera.left;
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
  Image<Rgb> image(scenario_.width, scenario_.height);
  RayScene::Directions rays;
  RayScene::Hits found;
  for (int y = 0; y < scenario_.height; ++y) {
    for (int x = 0; x < scenario_.width; ++x) {
      const Hit& hit = hits[static_cast<size_t>(y) * scenario_.width + x];
      bool edge = false;
      if (x > 0) edge |= differ(hit, *(&hit - 1));
      if (x + 1 < scenario_.width) edge |= differ(hit, *(&hit + 1));
      if (y > 0) edge |= differ(hit, *(&hit - scenario_.width));
      if (y + 1 < scenario_.height) edge |= differ(hit, *(&hit + scenario_.width));
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

std::vector<std::optional<SE3>> Renderer::motions(const View& view, int frame) const {
  const SE3 T_other_world = scenario_.T_world_camera[frame].inverse();
  std::vector<std::optional<SE3>> T_other_curr(view.T_camera_body.size());
  T_other_curr[0] = T_other_world * view.T_camera_body[0]->inverse();
  for (size_t i = 1; i < T_other_curr.size(); ++i) {
    const std::optional<SE3>& T_world_object = scenario_.actors[i - 1].T_world_object[frame];
    if (!view.T_camera_body[i] || !T_world_object) continue;
    T_other_curr[i] = T_other_world * *T_world_object * view.T_camera_body[i]->inverse();
  }
  return T_other_curr;
}

Image<Flow> Renderer::render_flow(const View& view, const std::vector<Hit>& hits, int frame) const {
  const PinholeCamera& pinhole = scenario_.camera.left;
  const auto T_other_curr = motions(view, frame);
  Image<Flow> flow(scenario_.width, scenario_.height);
  for (int y = 0; y < scenario_.height; ++y) {
    for (int x = 0; x < scenario_.width; ++x) {
      const Hit& hit = hits[static_cast<size_t>(y) * scenario_.width + x];
      if (hit.body == Hit::kNone || !T_other_curr[hit.body]) continue;
      const auto stored_m = static_cast<double>(static_cast<float>(hit.depth_m));
      const Vector3d other = *T_other_curr[hit.body] * pinhole.backproject(x, y, stored_m);
      if (other.z() < kNearestFlow_m) continue;
      const Eigen::Vector2d pixel = pinhole.project(other);
      flow(x, y) = {static_cast<float>(pixel.x() - x), static_cast<float>(pixel.y() - y)};
    }
  }
  return flow;
}

}  // namespace sextant::synthetic
