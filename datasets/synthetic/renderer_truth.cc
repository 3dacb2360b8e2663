#include <algorithm>

#include "sextant/datasets/synthetic/renderer.h"
#include "sextant/datasets/synthetic/view.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

/// A half-open rectangle of pixels.
struct Window {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Where a mesh can be seen at most.
Window window_of(const Mesh& mesh, const SE3& T_camera_body, const PinholeCamera& camera, int width,
                 int height) {
  constexpr double kNear_m = 0.1;
  double left = width, top = height, right = 0, bottom = 0;
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
  if (n_behind > 0) return {0, 0, width, height};  // it crosses the camera's plane
  const auto clamp = [](double value, int high) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(high)));
  };
  return {clamp(left - 1, width), clamp(top - 1, height), clamp(right + 2, width), clamp(bottom + 2, height)};
}

/// The smallest window that holds all pixels of one body inside `window`: rows and columns are cast from the
/// rim inwards until one shows the body, so that an open view of it costs no more than its outline.
class BoxFinder {
 public:
  BoxFinder(const RayScene& scene, const PinholeCamera& camera, uint32_t body)
      : scene_(scene), camera_(camera), body_(body) {}

  /// Nothing when no pixel shows the body.
  std::optional<Window> find(Window w) const {
    const auto row = [&](int y) { return shows(w.x0, y, w.x1 - w.x0, 1, 0); };
    const auto column = [&](int x) { return shows(x, w.y0, w.y1 - w.y0, 0, 1); };
    while (w.y0 < w.y1 && !row(w.y0)) ++w.y0;
    if (w.y0 >= w.y1) return std::nullopt;
    while (!row(w.y1 - 1)) --w.y1;
    while (!column(w.x0)) ++w.x0;
    while (!column(w.x1 - 1)) --w.x1;
    return w;
  }

 private:
  bool shows(int x, int y, int length, int step_x, int step_y) const {
    RayScene::Directions rays;
    RayScene::Hits found;
    for (int at = 0; at < length; at += RayScene::kWidth) {
      const int n = std::min(RayScene::kWidth, length - at);
      for (int i = 0; i < n; ++i) rays[i] = camera_.ray(x + (at + i) * step_x, y + (at + i) * step_y);
      scene_.cast(rays, n, false, found);
      for (int i = 0; i < n; ++i) {
        if (found[i].body == body_) return true;
      }
    }
    return false;
  }

  const RayScene& scene_;
  const PinholeCamera& camera_;
  uint32_t body_;
};

}  // namespace

SequenceTruth Renderer::truth(int first, int last) const {
  const PinholeCamera& pinhole = scenario_.camera.left;
  SequenceTruth truth;
  for (int frame = first; frame <= last; ++frame) {
    truth.camera.set(frame, scenario_.T_world_camera[frame]);
    const View now = view(frame);
    for (uint32_t body = 1; body < bodies_->size(); ++body) {
      const std::optional<SE3>& T_camera_object = now.T_camera_body[body];
      if (!T_camera_object) continue;
      const Window window =
          window_of(bodies_->mesh(body), *T_camera_object, pinhole, scenario_.width, scenario_.height);
      const std::optional<Window> seen = BoxFinder(*now.scene, pinhole, body).find(window);
      if (!seen) continue;
      const Actor& actor = scenario_.actors[body - 1];
      ObjectTruth object;
      object.id = actor.id;
      object.T_camera_object = *T_camera_object;
      object.left = seen->x0;
      object.top = seen->y0;
      object.right = seen->x1 - 1;
      object.bottom = seen->y1 - 1;
      object.moving = actor.moving;
      object.size_m = Vector3d(actor.shape.width_m, actor.shape.height_m, actor.shape.length_m);
      object.type = actor.type;
      truth.objects[frame].push_back(std::move(object));
    }
    if (const auto it = truth.objects.find(frame); it != truth.objects.end()) {
      std::ranges::sort(it->second, {}, &ObjectTruth::id);
    }
  }
  return truth;
}

}  // namespace sextant::synthetic
