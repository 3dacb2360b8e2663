#include "sextant/datasets/synthetic/ray_scene.h"

#include <embree3/rtcore.h>

#include <cmath>
#include <limits>

#include "sextant/base/error.h"

namespace sextant::synthetic {
namespace {

using Eigen::Vector3d;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNearest_m = 0.05F;

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

struct Bodies::Handles {
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

struct RayScene::Handle {
  RTCScene scene = nullptr;
  explicit Handle(RTCDevice device) : scene(rtcNewScene(device)) {}
  ~Handle() { rtcReleaseScene(scene); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
};

Bodies::Bodies(std::vector<Mesh> meshes) : meshes_(std::move(meshes)), handles_(std::make_unique<Handles>()) {
  for (const Mesh& mesh : meshes_) handles_->scenes.push_back(build_scene(handles_->device, mesh));
}

Bodies::~Bodies() = default;

RayScene::RayScene(const Bodies& bodies, std::span<const std::optional<SE3>> T_camera_body,
                   const Vector3d& to_sun_camera)
    : bodies_(bodies),
      to_sun_(to_sun_camera.normalized()),
      handle_(std::make_unique<Handle>(bodies.handles_->device)) {
  SEXTANT_CHECK(T_camera_body.size() == bodies.size());
  rtcSetSceneFlags(handle_->scene, RTC_SCENE_FLAG_ROBUST);
  for (unsigned i = 0; i < T_camera_body.size(); ++i) {
    const SE3 T = T_camera_body[i].value_or(SE3());
    T_body_camera_.push_back(T.inverse());
    R_camera_body_.push_back(T.rotation().toRotationMatrix());
    if (!T_camera_body[i]) continue;
    RTCGeometry instance = rtcNewGeometry(bodies.handles_->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, bodies.handles_->scenes[i]);
    const Eigen::Matrix<float, 3, 4> transform = T.matrix().topRows<3>().cast<float>();
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.data());
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(handle_->scene, instance, i);
    rtcReleaseGeometry(instance);
  }
  rtcCommitScene(handle_->scene);
}

RayScene::~RayScene() = default;

void RayScene::cast(const Directions& rays, int n, bool shadows, Hits& hits) const {
  alignas(32) std::array<int, kWidth> valid{};
  RTCRayHit8 packet{};
  for (int i = 0; i < n; ++i) {
    valid[i] = -1;
    packet.ray.dir_x[i] = static_cast<float>(rays[i].x());
    packet.ray.dir_y[i] = static_cast<float>(rays[i].y());
    packet.ray.dir_z[i] = static_cast<float>(rays[i].z());
    packet.ray.tnear[i] = kNearest_m;
    packet.ray.tfar[i] = kInfinity;
    packet.ray.mask[i] = 0xffffffffU;
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid.data(), handle_->scene, &context, &packet);
  for (int i = 0; i < n; ++i) {
    Hit& hit = hits[i];
    hit = {};
    if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    hit.body = packet.hit.instID[0][i];
    hit.triangle = packet.hit.primID[i];
    const Mesh& mesh = bodies_.mesh(hit.body);
    const Triangle& triangle = mesh.triangles[hit.triangle];
    const Vector3d origin = T_body_camera_[hit.body].translation();
    const Vector3d along = R_camera_body_[hit.body].transpose() * rays[i];
    const double exact =
        triangle.normal.dot(mesh.vertices[triangle.vertices[0]] - origin) / triangle.normal.dot(along);
    // A surface seen edge-on has no sharp depth: then the caster's own stands.
    const double found = packet.ray.tfar[i];
    hit.depth_m = std::abs(exact - found) < 1e-3 * found ? exact : found;
  }
  if (shadows) cast_shadows(rays, n, hits);
}

void RayScene::cast_shadows(const Directions& rays, int n, Hits& hits) const {
  alignas(32) std::array<int, kWidth> valid{};
  RTCRay8 packet{};
  for (int i = 0; i < n; ++i) {
    if (hits[i].body == Hit::kNone) continue;
    const Vector3d normal = this->normal(hits[i], rays[i]);
    if (normal.dot(to_sun_) <= 0) {
      hits[i].shadowed = true;
      continue;
    }
    const Vector3d from = hits[i].depth_m * rays[i] + (0.003 + 1e-4 * hits[i].depth_m) * normal;
    valid[i] = -1;
    packet.org_x[i] = static_cast<float>(from.x());
    packet.org_y[i] = static_cast<float>(from.y());
    packet.org_z[i] = static_cast<float>(from.z());
    packet.dir_x[i] = static_cast<float>(to_sun_.x());
    packet.dir_y[i] = static_cast<float>(to_sun_.y());
    packet.dir_z[i] = static_cast<float>(to_sun_.z());
    packet.tnear[i] = 0.02F;
    packet.tfar[i] = kInfinity;
    packet.mask[i] = 0xffffffffU;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid.data(), handle_->scene, &context, &packet);
  for (int i = 0; i < n; ++i) {
    if (valid[i] != 0 && packet.tfar[i] < 0) hits[i].shadowed = true;
  }
}

Vector3d RayScene::normal(const Hit& hit, const Vector3d& ray) const {
  const Vector3d n = R_camera_body_[hit.body] * bodies_.mesh(hit.body).triangles[hit.triangle].normal;
  return n.dot(ray) > 0 ? -n : n;
}

}  // namespace sextant::synthetic
