#include "sextant/datasets/synthetic/renderer.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <mutex>

#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/synthetic/painter.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

constexpr double kNearestFlow_m = 0.1;

std::vector<Mesh> meshes_of(const Scenario& scenario) {
  std::vector<Mesh> meshes = {scenario.world};
  for (const Actor& actor : scenario.actors) meshes.push_back(make_car(actor.shape));
  return meshes;
}

/// The views of the last few frames.
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
    std::shared_ptr<const View> view = make();  // two threads may make the same one
    const std::lock_guard lock(mutex_);
    views_.push_back(view);
    if (views_.size() > kKept) views_.pop_front();
    return view;
  }

 private:
  static constexpr size_t kKept = 6;
  std::mutex mutex_;
  std::deque<std::shared_ptr<const View>> views_;
};

/// Where the points of every body are for another camera at another time.
class Reprojection {
 public:
  Reprojection(const Scenario& scenario, const Bodies& bodies, const View& from, const View& to)
      : camera_(scenario.camera.left), bodies_(bodies), from_(from), motions_(from.T_camera_body.size()) {
    for (size_t i = 0; i < motions_.size(); ++i) {
      if (!from.T_camera_body[i] || !to.T_camera_body[i]) continue;
      const SE3 T_to_from = *to.T_camera_body[i] * from.T_camera_body[i]->inverse();
      motions_[i] = {true, T_to_from.rotation().toRotationMatrix(), T_to_from.translation()};
    }
  }

  struct Target {
    bool known = false;  ///< the body is there
    Vector3d point;      ///< camera coordinates
    double x = 0, y = 0;
    bool ahead() const { return point.z() >= kNearestFlow_m; }
  };
  Target operator()(int x, int y, uint32_t surface) const {
    Target target;
    if (surface == Bodies::kSky) return target;
    const Motion& motion = motions_[bodies_.body_of(surface)];
    if (!motion.known) return target;
    const Vector3d ray = camera_.ray(x, y);
    const auto stored_m = static_cast<double>(static_cast<float>(from_.surfaces.depth_m(surface, ray)));
    target.known = true;
    target.point = motion.R * (stored_m * ray) + motion.t;
    const double per_z = 1 / target.point.z();
    target.x = camera_.fx * target.point.x() * per_z + camera_.cx;
    target.y = camera_.fy * target.point.y() * per_z + camera_.cy;
    return target;
  }

 private:
  struct Motion {
    bool known = false;
    Eigen::Matrix3d R;
    Vector3d t;
  };
  PinholeCamera camera_;
  const Bodies& bodies_;
  const View& from_;
  std::vector<Motion> motions_;
};

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
  Image<Flow> flow(const View& from, const View& to) const;
  Image<Occlusion> occlusion(const View& from, const View& to) const;

  template <typename T, typename Function>
  Image<T> each_pixel(const Function& function) const {
    Image<T> image(scenario.width, scenario.height);
    for (int y = 0; y < scenario.height; ++y) {
      for (int x = 0; x < scenario.width; ++x) image(x, y) = function(x, y);
    }
    return image;
  }
};

Image<float> Renderer::Parts::depth(const View& v) const {
  return each_pixel<float>([&](int x, int y) {
    const uint32_t surface = v.seen(x, y);
    if (surface == Bodies::kSky) return NAN;
    return static_cast<float>(v.surfaces.depth_m(surface, scenario.camera.left.ray(x, y)));
  });
}

Image<uint16_t> Renderer::Parts::mask(const View& v) const {
  return each_pixel<uint16_t>([&](int x, int y) -> uint16_t {
    const uint32_t body = v.seen(x, y) == Bodies::kSky ? 0 : bodies.body_of(v.seen(x, y));
    return body == 0 ? 0 : static_cast<uint16_t>(scenario.actors[body - 1].id);
  });
}

Image<Flow> Renderer::Parts::flow(const View& from, const View& to) const {
  const Reprojection reproject(scenario, bodies, from, to);
  return each_pixel<Flow>([&](int x, int y) {
    const auto target = reproject(x, y, from.seen(x, y));
    if (!target.known || !target.ahead()) return Flow{};
    return Flow{static_cast<float>(target.x - x), static_cast<float>(target.y - y)};
  });
}

Image<Occlusion> Renderer::Parts::occlusion(const View& from, const View& to) const {
  const Reprojection reproject(scenario, bodies, from, to);
  return each_pixel<Occlusion>([&](int x, int y) {
    const uint32_t surface = from.seen(x, y);
    const auto target = reproject(x, y, surface);
    if (!target.known) return Occlusion::unknown;
    if (!target.ahead() || target.x < -0.5 || target.y < -0.5 || target.x >= scenario.width - 0.5 ||
        target.y >= scenario.height - 0.5) {
      return Occlusion::outside;
    }
    const Vector3d ray = target.point / target.point.z();
    const double tolerance_m = std::max(0.03, 0.005 * target.point.z());
    const int x0 = static_cast<int>(std::floor(target.x)), y0 = static_cast<int>(std::floor(target.y));
    for (int j = std::max(y0, 0); j <= std::min(y0 + 1, scenario.height - 1); ++j) {
      for (int i = std::max(x0, 0); i <= std::min(x0 + 1, scenario.width - 1); ++i) {
        const uint32_t other = to.seen(i, j);
        if (other == surface) return Occlusion::visible;
        if (other == Bodies::kSky || bodies.body_of(other) != bodies.body_of(surface)) continue;
        if (std::abs(to.surfaces.depth_m(other, ray) - target.point.z()) < tolerance_m) {
          return Occlusion::visible;
        }
      }
    }
    return Occlusion::hidden;
  });
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
  const bool colours = channels.gray || channels.rgb;
  if (channels.rgb_right) out.rgb_right = parts_->rgb_right(frame);
  if (!colours && !channels.depth && !channels.flow && !channels.backward_flow && !channels.mask &&
      !channels.occlusion) {
    return out;
  }
  const std::shared_ptr<const View> view = parts_->view(frame);
  if (colours) out.rgb = parts_->rgb(*view);
  if (channels.gray) out.gray = rgb_to_gray(out.rgb);
  if (!channels.rgb) out.rgb = {};
  if (channels.depth) out.depth_m = parts_->depth(*view);
  if (channels.mask) out.mask = parts_->mask(*view);
  if ((channels.flow || channels.occlusion) && frame + 1 < scenario().n_frames()) {
    const std::shared_ptr<const View> next = parts_->view(frame + 1);
    if (channels.flow) out.flow = parts_->flow(*view, *next);
    if (channels.occlusion) out.occlusion = parts_->occlusion(*view, *next);
  }
  if (channels.backward_flow && frame > 0) {
    out.backward_flow = parts_->flow(*view, *parts_->view(frame - 1));
  }
  return out;
}

SequenceTruth Renderer::truth(int first, int last) const {
  const Bodies& bodies = parts_->bodies;
  SequenceTruth truth;
  for (int frame = first; frame <= last; ++frame) {
    truth.camera.set(frame, scenario().T_world_camera[frame]);
    const std::shared_ptr<const View> view = parts_->view(frame);
    struct Box {
      int left = 1 << 30, top = 1 << 30, right = -1, bottom = -1;
    };
    std::vector<Box> boxes(bodies.size());
    for (int y = 0; y < view->seen.height(); ++y) {
      for (int x = 0; x < view->seen.width(); ++x) {
        if (view->seen(x, y) < bodies.first_surface(1) || view->seen(x, y) == Bodies::kSky) continue;
        Box& box = boxes[bodies.body_of(view->seen(x, y))];
        box = {std::min(box.left, x), std::min(box.top, y), std::max(box.right, x), std::max(box.bottom, y)};
      }
    }
    for (size_t body = 1; body < bodies.size(); ++body) {
      if (boxes[body].right < 0) continue;
      const Actor& actor = scenario().actors[body - 1];
      ObjectTruth object;
      object.id = actor.id;
      object.T_camera_object = *view->T_camera_body[body];
      object.left = boxes[body].left;
      object.top = boxes[body].top;
      object.right = boxes[body].right;
      object.bottom = boxes[body].bottom;
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
