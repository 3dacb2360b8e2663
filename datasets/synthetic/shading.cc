#include "sextant/datasets/synthetic/shading.h"

#if SEXTANT_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"

namespace sextant::synthetic {
namespace {

std::vector<std::optional<SE3>> poses(const Scenario& scenario, int frame, const SE3& T_camera_world) {
  std::vector<std::optional<SE3>> T_camera_body = {T_camera_world};
  for (const Actor& actor : scenario.actors) {
    const std::optional<SE3>& T_world_object = actor.T_world_object[frame];
    T_camera_body.push_back(T_world_object ? std::optional(T_camera_world * *T_world_object) : std::nullopt);
  }
  return T_camera_body;
}

}  // namespace

View::View(const Scenario& scenario, const Bodies& bodies, int frame_number, double right_m)
    : frame(frame_number),
      T_world_camera(scenario.T_world_camera[frame_number] *
                     SE3(Eigen::Quaterniond::Identity(), {right_m, 0, 0})),
      T_camera_body(poses(scenario, frame, T_world_camera.inverse())),
      surfaces(bodies, T_camera_body, scenario.camera.left, scenario.width, scenario.height),
      seen(surfaces.seen()) {}

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Determines which of the rays are blocked: tfar < 0. They are nearly parallel and have adjacent origins.
void find_occluded(const int* valid, RTCScene scene, RTCRay8& rays) {
#if SEXTANT_EMBREE == 3
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &context, &rays);
#else
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &rays, &arguments);
#endif
}

RTCScene build_scene(RTCDevice device, const Mesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  auto* indices = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), mesh.triangles.size()));
  SEXTANT_CHECK(vertices != nullptr && indices != nullptr);
  for (const Vector3d& vertex : mesh.vertices) {
    for (int i = 0; i < 3; ++i) *vertices++ = static_cast<float>(vertex[i]);
  }
  for (const Triangle& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle.vertices) *indices++ = vertex;
  }
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);  // no gaps between triangles that share an edge
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

}  // namespace

struct ShadowCasters::Handles {
  RTCDevice device = nullptr;
  std::vector<RTCScene> scenes;

  Handles() : device(rtcNewDevice("threads=1")) {
    if (device == nullptr)
      fail("cannot start the ray caster: Embree error {}", static_cast<int>(rtcGetDeviceError(nullptr)));
  }
  ~Handles() {
    for (RTCScene scene : scenes) rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;
};

struct SunRays::Handle {
  RTCScene scene = nullptr;
  explicit Handle(RTCDevice device) : scene(rtcNewScene(device)) {}
  ~Handle() { rtcReleaseScene(scene); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
};

Vector3d to_sun() { return Vector3d(0.55, -0.95, -0.42).normalized(); }

ShadowCasters::ShadowCasters(const Bodies& bodies) : handles_(std::make_unique<Handles>()) {
  for (size_t body = 0; body < bodies.size(); ++body) {
    handles_->scenes.push_back(build_scene(handles_->device, bodies.mesh(body)));
  }
}

ShadowCasters::~ShadowCasters() = default;

SunRays::SunRays(const ShadowCasters& casters, std::span<const std::optional<SE3>> T_camera_body,
                 const Vector3d& to_sun_camera)
    : to_sun_(to_sun_camera.normalized().cast<float>()),
      handle_(std::make_unique<Handle>(casters.handles_->device)) {
  SEXTANT_CHECK(T_camera_body.size() == casters.handles_->scenes.size());
  for (unsigned i = 0; i < T_camera_body.size(); ++i) {
    if (!T_camera_body[i]) continue;
    RTCGeometry instance = rtcNewGeometry(casters.handles_->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, casters.handles_->scenes[i]);
    const Eigen::Matrix<float, 3, 4> transform = T_camera_body[i]->matrix().topRows<3>().cast<float>();
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.data());
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(handle_->scene, instance, i);
    rtcReleaseGeometry(instance);
  }
  rtcCommitScene(handle_->scene);
}

SunRays::~SunRays() = default;

void SunRays::cast(std::span<const Vector3f> points, std::span<uint8_t> shadowed) const {
  constexpr size_t rays = 8;
  for (size_t from = 0; from < points.size(); from += rays) {
    const size_t n = std::min(rays, points.size() - from);
    alignas(32) std::array<int, rays> valid{};
    RTCRay8 packet{};
    for (size_t i = 0; i < n; ++i) {
      valid[i] = -1;
      packet.org_x[i] = points[from + i].x();
      packet.org_y[i] = points[from + i].y();
      packet.org_z[i] = points[from + i].z();
      packet.dir_x[i] = to_sun_.x();
      packet.dir_y[i] = to_sun_.y();
      packet.dir_z[i] = to_sun_.z();
      packet.tnear[i] = 0.02F;
      packet.tfar[i] = std::numeric_limits<float>::infinity();
      packet.mask[i] = 0xffffffffU;
    }
    find_occluded(valid.data(), handle_->scene, packet);
    for (size_t i = 0; i < n; ++i) shadowed[from + i] = packet.tfar[i] < 0 ? 1 : 0;
  }
}

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

SEXTANT_INLINED float at(const Shader::Linear& f, float x, float y) { return f.c + (f.x * x + f.y * y); }

SEXTANT_SIMD void project(const Shader::Facet& facet, const Shader::Rays& rays, const float* __restrict x,
                          const float* __restrict y, const float* __restrict sun, int first, int n,
                          Footprints& f, Shader::Light& light) {
  const Shader::Facet s = facet;
  const Shader::Rays r = rays;
  for (int k = 0; k < n; ++k) {
    const int i = first + k;
    const float inverse = at(s.inverse_depth, x[k], y[k]);
    const float z = 1.0F / inverse;
    const float ahead = wide::max(wide::min(z, s.farthest_m), s.nearest_m);
    const float depth_m = inverse > 0 ? ahead : s.farthest_m;
    const float u_r = at(s.u, x[k], y[k]), v_r = at(s.v, x[k], y[k]);
    f.u[i] = depth_m * u_r + s.u_camera;
    f.v[i] = depth_m * v_r + s.v_camera;
    // p = z(x, y) r(x, y) with z = d / (n.r): derivatives with respect to the pixel, along the texture's
    // axes.
    const float slant = wide::max(s.distance_m * inverse, 1e-4F);
    const float tilt_x = s.n_x / slant, tilt_y = s.n_y / slant;
    f.u_x[i] = depth_m * (s.u.x + u_r * tilt_x);
    f.v_x[i] = depth_m * (s.v.x + v_r * tilt_x);
    f.u_y[i] = depth_m * (s.u.y + u_r * tilt_y);
    f.v_y[i] = depth_m * (s.v.y + v_r * tilt_y);
    const float ray_x = at(r.x, x[k], y[k]), ray_y = at(r.y, x[k], y[k]);
    const float length = std::sqrt(ray_x * ray_x + ray_y * ray_y + 1.0F);
    const float facing = slant / length;
    light.range_m[i] = depth_m * length;
    light.facing[i] = facing;
    light.mirror_y[i] = at(r.world_y, x[k], y[k]) / length + 2 * facing * s.normal_y;
    light.red[i] = s.sky_light[0] + sun[k] * s.sun_light[0];
    light.green[i] = s.sky_light[1] + sun[k] * s.sun_light[1];
    light.blue[i] = s.sky_light[2] + sun[k] * s.sun_light[2];
  }
}

SEXTANT_SIMD void directions(const Shader::Rays& rays, const float* __restrict x, const float* __restrict y,
                             int first, int n, Footprints& f) {
  const Shader::Rays r = rays;
  for (int k = 0; k < n; ++k) {
    f.u[first + k] = at(r.world_x, x[k], y[k]);
    f.v[first + k] = at(r.world_y, x[k], y[k]);
    f.u_x[first + k] = at(r.world_z, x[k], y[k]);
  }
}

/// Adds light on the surface, a reflection of the sky (glass, paint; stronger at grazing angles), and haze.
SEXTANT_SIMD void illuminate(const Shader::Light& light, float mirroring, int n, Colours& c) {
  for (int i = 0; i < n; ++i) {
    const float grazing = (1 - light.facing[i]) * (1 - light.facing[i]);
    const float up = wide::clamp(0.5F - 1.5F * light.mirror_y[i], 0.0F, 1.0F);
    const float mirror = mirroring * (0.04F + 0.35F * grazing * grazing) * up;
    // 1 - exp(-range / 700 m), by the inverse of the exponential's series.
    const float t = light.range_m[i] * (1 / 700.0F);
    const float haze = 1.0F - 1.0F / (1.0F + t * (1.0F + t * (0.5F + t * 0.1667F)));
    c.red[i] = wide::mix(c.red[i] * light.red[i] + mirror * 0.80F, 0.78F, haze);
    c.green[i] = wide::mix(c.green[i] * light.green[i] + mirror * 0.85F, 0.83F, haze);
    c.blue[i] = wide::mix(c.blue[i] * light.blue[i] + mirror * 0.92F, 0.90F, haze);
  }
}

bool same(const Look* a, const Look* b) {
  if (a == b) return true;
  if (a == nullptr || b == nullptr) return false;
  return a->material == b->material && a->seed == b->seed && a->extent == b->extent && a->colour == b->colour;
}

}  // namespace

Shader::Shader(const Bodies& bodies, const View& view, const PinholeCamera& camera, Sink& sink)
    : bodies_(bodies),
      view_(view),
      camera_(camera),
      R_world_camera_(view.T_world_camera.rotation().toRotationMatrix()),
      to_sun_(to_sun()),
      sink_(sink) {
  for (const auto& T : view.T_camera_body) {
    const SE3 T_camera_body = T.value_or(SE3());
    R_camera_body_.push_back(T_camera_body.rotation().toRotationMatrix());
    camera_in_body_.push_back(T_camera_body.inverse().translation());
  }
  rays_ = {linear(Vector3d::UnitX()), linear(Vector3d::UnitY()), linear(R_world_camera_.row(0).transpose()),
           linear(R_world_camera_.row(1).transpose()), linear(R_world_camera_.row(2).transpose())};
}

Shader::Linear Shader::linear(const Vector3d& of_ray) const {
  const double x = of_ray.x() / camera_.fx, y = of_ray.y() / camera_.fy;
  return {static_cast<float>(x), static_cast<float>(y),
          static_cast<float>(of_ray.z() - x * camera_.cx - y * camera_.cy)};
}

Shader::Facet Shader::facet(uint32_t surface, float x, float y) const {
  const uint32_t body = bodies_.body_of(surface);
  const Patch& patch = bodies_.patch(surface);
  const auto& plane = view_.surfaces.plane(surface);
  const bool turned = plane.normal.dot(camera_.ray(x, y)) > 0;
  const Vector3d normal = turned ? Vector3d(-plane.normal) : plane.normal;
  const Vector3d u_axis = R_camera_body_[body] * patch.u_axis, v_axis = R_camera_body_[body] * patch.v_axis;
  Facet f;
  f.inverse_depth = linear(plane.normal / plane.distance);
  f.distance_m = static_cast<float>(std::abs(plane.distance));
  f.nearest_m = static_cast<float>(plane.nearest_m);
  f.farthest_m = static_cast<float>(plane.farthest_m);
  f.u = linear(u_axis);
  f.v = linear(v_axis);
  f.u_camera = static_cast<float>(patch.u_axis.dot(camera_in_body_[body] - patch.origin));
  f.v_camera = static_cast<float>(patch.v_axis.dot(camera_in_body_[body] - patch.origin));
  f.n_x = static_cast<float>(normal.x() / camera_.fx);
  f.n_y = static_cast<float>(normal.y() / camera_.fy);
  const Vector3d normal_world = R_world_camera_ * normal;
  f.normal_y = static_cast<float>(normal_world.y());
  const auto sun = static_cast<float>(std::max(0.0, normal_world.dot(to_sun_)));
  // share of the sky that the surface faces
  const auto open = static_cast<float>(0.5 - 0.5 * normal_world.y());
  const Vector3f sky_light = Vector3f(0.36F, 0.40F, 0.47F) * (0.55F + 0.75F * open);
  const Vector3f sun_light = Vector3f(1.02F, 0.96F, 0.86F) * sun;
  for (int i = 0; i < 3; ++i) {
    f.sky_light[i] = sky_light[i];
    f.sun_light[i] = sun_light[i];
  }
  return f;
}

void Shader::shade(uint32_t surface, const Samples& samples) {
  const bool sky = surface == Bodies::sky_surface;
  const Look* look = sky ? nullptr : &bodies_.patch(surface).look;
  if (!same(look, look_)) flush();
  look_ = look;
  Facet facet;
  if (!sky) facet = this->facet(surface, samples.x[0], samples.y[0]);
  for (size_t from = 0; from < samples.x.size();) {
    if (n_ == NoiseTile::batch) flush();
    const size_t n = std::min(samples.x.size() - from, static_cast<size_t>(NoiseTile::batch - n_));
    if (sky) {
      directions(rays_, &samples.x[from], &samples.y[from], n_, static_cast<int>(n), footprints_);
    } else {
      project(facet, rays_, &samples.x[from], &samples.y[from], &samples.sun[from], n_, static_cast<int>(n),
              footprints_, light_);
    }
    std::copy_n(&samples.target[from], n, targets_ + n_);
    n_ += static_cast<int>(n);
    from += n;
  }
}

void Shader::flush() {
  if (n_ == 0) return;
  if (look_ == nullptr) {
    sky_colours(footprints_, n_, colours_);
  } else {
    footprints_.measure(n_);
    surface_colours(*look_, footprints_, n_, colours_);
    const bool mirrors = look_->material == Material::glass || look_->material == Material::paint;
    illuminate(light_, mirrors ? 1.0F : 0.0F, wide::whole(n_), colours_);
  }
  sink_.take({targets_, static_cast<size_t>(n_)}, colours_);
  n_ = 0;
}

}  // namespace sextant::synthetic
