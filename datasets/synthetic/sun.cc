#include "sextant/datasets/synthetic/sun.h"

#if SEXTANT_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <algorithm>
#include <limits>

#include "sextant/base/error.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Which of the rays are blocked, as tfar < 0. They are nearly parallel and begin side by side.
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

}  // namespace sextant::synthetic
