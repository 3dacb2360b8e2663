#include "sextant/datasets/synthetic/renderer.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <mutex>

#include "sextant/datasets/synthetic/shading.h"
#include "sextant/datasets/synthetic/wide.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

constexpr double nearest_flow_m = 0.1;

std::vector<Mesh> meshes_of(const Scenario& scenario) {
  std::vector<Mesh> meshes = {scenario.world};
  for (const Actor& actor : scenario.actors) meshes.push_back(make_car(actor.shape));
  return meshes;
}

}  // namespace

/// Cache of the views of the last few frames.
class Views {
 public:
  template <typename Make>
  std::shared_ptr<const View> get(int frame, const Make& make) {
    {
      const std::lock_guard lock(mutex_);
      for (const auto& view : views_) {
        if (view->frame == frame) return view;
      }
    }
    std::shared_ptr<const View> view = make();  // two threads may make the same view
    const std::lock_guard lock(mutex_);
    views_.push_back(view);
    if (views_.size() > kept) views_.pop_front();
    return view;
  }

 private:
  static constexpr size_t kept = 6;
  std::mutex mutex_;
  std::deque<std::shared_ptr<const View>> views_;
};

namespace {

/// Rays of the columns and rows of an image: (x, y, 1).
struct Rays {
  std::vector<double> x, y;
  Rays(const PinholeCamera& camera, int width, int height) {
    for (int i = 0; i < width; ++i) x.push_back(camera.ray(i, 0).x());
    for (int i = 0; i < height; ++i) y.push_back(camera.ray(0, i).y());
  }
};

/// Computes Surfaces::depth_m() for a row of rays.
SEXTANT_SIMD void row_depths(const Surfaces::Plane& plane, const double* __restrict ray_x, double ray_y,
                             int n, float* __restrict depth_m) {
  const double nx = plane.normal.x(), nz = plane.normal.z(), y = plane.normal.y() * ray_y;
  const double distance = plane.distance, nearest_m = plane.nearest_m, farthest_m = plane.farthest_m;
  for (int i = 0; i < n; ++i) {
    const double z = distance / (nx * ray_x[i] + y + nz);
    const double too_near = z > 0 ? nearest_m : farthest_m;
    const double too_far = z < farthest_m ? z : farthest_m;
    depth_m[i] = static_cast<float>(z >= nearest_m ? too_far : too_near);
  }
}

/// Pixels and depths, for another camera at another time, of the points in a row of an image. NaN: there is
/// no point (sky), or its body does not exist at that time.
struct Targets {
  std::vector<double> x, y, z_m;
  explicit Targets(int width) : x(width), y(width), z_m(width) {}
};

/// Motion p -> R p + t, and the camera after it.
struct Motion {
  double R[9], t[3];
  double fx, fy, cx, cy;
};

SEXTANT_SIMD void move_row(const Motion& motion, const double* __restrict ray_x, double ray_y,
                           const float* __restrict depth_m, int n, double* __restrict x, double* __restrict y,
                           double* __restrict z_m) {
  const Motion m = motion;
  for (int i = 0; i < n; ++i) {
    const auto z = static_cast<double>(depth_m[i]);
    const double px = z * ray_x[i], py = z * ray_y;
    const double moved_z = m.R[6] * px + m.R[7] * py + m.R[8] * z + m.t[2];
    const double per_z = 1 / moved_z;
    x[i] = m.fx * (m.R[0] * px + m.R[1] * py + m.R[2] * z + m.t[0]) * per_z + m.cx;
    y[i] = m.fy * (m.R[3] * px + m.R[4] * py + m.R[5] * z + m.t[1]) * per_z + m.cy;
    z_m[i] = moved_z;
  }
}

class Reprojection {
 public:
  Reprojection(const PinholeCamera& camera, const Bodies& bodies, const View& from, const View& to)
      : bodies_(bodies),
        from_(from),
        rays_(camera, from.seen.width(), from.seen.height()),
        motions_(from.T_camera_body.size()) {
    for (size_t i = 0; i < motions_.size(); ++i) {
      if (!from.T_camera_body[i] || !to.T_camera_body[i]) continue;
      const SE3 T_to_from = *to.T_camera_body[i] * from.T_camera_body[i]->inverse();
      const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = T_to_from.rotation().toRotationMatrix();
      const Vector3d& t = T_to_from.translation();
      Motion& m =
          motions_[i].emplace(Motion{{}, {t.x(), t.y(), t.z()}, camera.fx, camera.fy, camera.cx, camera.cy});
      std::copy_n(R.data(), 9, m.R);
    }
  }

  /// Computes the targets from the stored depths of the row.
  void row(int y, const float* depth_m, Targets& targets) const {
    const uint32_t* seen = from_.seen.row(y);
    const int width = from_.seen.width();
    for (int first = 0, end = 0; first < width; first = end) {
      const uint32_t body = body_of(seen[first]);
      end = first + 1;
      while (end < width && (seen[end] == seen[end - 1] || body_of(seen[end]) == body)) ++end;
      if (body == none || !motions_[body]) {
        std::fill(&targets.z_m[first], targets.z_m.data() + end, std::numeric_limits<double>::quiet_NaN());
        continue;
      }
      move_row(*motions_[body], &rays_.x[first], rays_.y[y], depth_m + first, end - first, &targets.x[first],
               &targets.y[first], &targets.z_m[first]);
    }
  }

 private:
  static constexpr uint32_t none = 0xffffffffU;
  uint32_t body_of(uint32_t surface) const {
    return surface == Bodies::sky_surface ? none : bodies_.body_of(surface);
  }

  const Bodies& bodies_;
  const View& from_;
  Rays rays_;
  std::vector<std::optional<Motion>> motions_;
};

/// Computes the flow of a row; invalid if the target is behind the camera or does not exist.
SEXTANT_SIMD void row_flow(const double* __restrict x, const double* __restrict y,
                           const double* __restrict z_m, int row, int n, Flow* __restrict flow) {
  for (int i = 0; i < n; ++i) {
    const bool ahead = z_m[i] >= nearest_flow_m;
    const auto u = static_cast<float>(x[i] - i), v = static_cast<float>(y[i] - row);
    flow[i].u = ahead ? u : std::numeric_limits<float>::quiet_NaN();
    flow[i].v = ahead ? v : std::numeric_limits<float>::quiet_NaN();
  }
}

}  // namespace

struct Renderer::Parts {
  Scenario scenario;
  Bodies bodies;
  ShadowCasters casters;
  Views views;

  explicit Parts(Scenario given) : scenario(std::move(given)), bodies(meshes_of(scenario)), casters(bodies) {}

  std::shared_ptr<const View> view(int frame) {
    return views.get(frame, [&] { return std::make_shared<const View>(scenario, bodies, frame, 0.0); });
  }
  Image<Rgb> rgb(const View& v) const { return paint(bodies, casters, v, scenario.camera.left); }
  Image<Rgb> rgb_right(int frame) const {
    return rgb(View(scenario, bodies, frame, scenario.camera.bf / scenario.camera.left.fx));
  }
  Image<float> depth(const View& v) const;
  Image<uint16_t> mask(const View& v) const;
  Image<Flow> flow(const View& from, const Image<float>& depth_m, const View& to) const;
};

Image<float> Renderer::Parts::depth(const View& v) const {
  const int width = scenario.width;
  const Rays rays(scenario.camera.left, width, scenario.height);
  Image<float> depth_m(width, scenario.height, NAN);
  for (int y = 0; y < scenario.height; ++y) {
    const uint32_t* seen = v.seen.row(y);
    for (int first = 0, end = 0; first < width; first = end) {
      end = first + 1;
      while (end < width && seen[end] == seen[first]) ++end;
      if (seen[first] == Bodies::sky_surface) continue;
      row_depths(v.surfaces.plane(seen[first]), &rays.x[first], rays.y[y], end - first,
                 depth_m.row(y) + first);
    }
  }
  return depth_m;
}

Image<uint16_t> Renderer::Parts::mask(const View& v) const {
  Image<uint16_t> mask(scenario.width, scenario.height, 0);
  for (size_t i = 0; i < mask.size(); ++i) {
    const uint32_t surface = v.seen.data()[i];
    if (surface < bodies.first_surface(1) || surface == Bodies::sky_surface) continue;
    mask.data()[i] = static_cast<uint16_t>(scenario.actors[bodies.body_of(surface) - 1].id);
  }
  return mask;
}

Image<Flow> Renderer::Parts::flow(const View& from, const Image<float>& depth_m, const View& to) const {
  const Reprojection reproject(scenario.camera.left, bodies, from, to);
  Image<Flow> flow(scenario.width, scenario.height);
  Targets targets(scenario.width);
  for (int y = 0; y < scenario.height; ++y) {
    reproject.row(y, depth_m.row(y), targets);
    row_flow(targets.x.data(), targets.y.data(), targets.z_m.data(), y, scenario.width, flow.row(y));
  }
  return flow;
}

Renderer::Renderer(Scenario scenario) {
  scenario.check();
  parts_ = std::make_unique<Parts>(std::move(scenario));
}

Renderer::~Renderer() = default;

const Scenario& Renderer::scenario() const { return parts_->scenario; }

Frame Renderer::render(int frame, const Channels& channels) const {
  SEXTANT_CHECK(frame >= 0 && frame < scenario().n_frames());
  Frame out;
  out.index = frame;
  if (channels.rgb_right) out.rgb_right = parts_->rgb_right(frame);
  const bool geometry = channels.depth || channels.flow || channels.backward_flow;
  if (!channels.rgb && !channels.mask && !geometry) return out;
  const std::shared_ptr<const View> view = parts_->view(frame);
  if (channels.rgb) out.rgb = parts_->rgb(*view);
  if (channels.mask) out.mask = parts_->mask(*view);
  if (!geometry) return out;
  Image<float> depth_m = parts_->depth(*view);
  if (channels.flow && frame + 1 < scenario().n_frames()) {
    out.flow = parts_->flow(*view, depth_m, *parts_->view(frame + 1));
  }
  if (channels.backward_flow && frame > 0) {
    out.backward_flow = parts_->flow(*view, depth_m, *parts_->view(frame - 1));
  }
  if (channels.depth) out.depth_m = std::move(depth_m);
  return out;
}

SequenceTruth Renderer::truth(int first, int last) const {
  const Bodies& bodies = parts_->bodies;
  SequenceTruth truth;
  for (int frame = first; frame <= last; ++frame) {
    truth.camera.set(frame, scenario().T_world_camera[frame]);
    const std::shared_ptr<const View> view = parts_->view(frame);
    std::vector<ImageBox> boxes(bodies.size());
    for (const auto [x, y] : pixels(view->seen)) {
      if (view->seen(x, y) < bodies.first_surface(1) || view->seen(x, y) == Bodies::sky_surface) continue;
      boxes[bodies.body_of(view->seen(x, y))].include(x, y);
    }
    for (size_t body = 1; body < bodies.size(); ++body) {
      if (boxes[body].right < 0) continue;
      const Actor& actor = scenario().actors[body - 1];
      ObjectTruth object;
      object.id = actor.id;
      object.T_camera_object = *view->T_camera_body[body];
      object.box = boxes[body];
      object.moving = actor.moves(frame);
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
