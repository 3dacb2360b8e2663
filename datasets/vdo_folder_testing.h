#pragma once

// A small VDO-SLAM folder for tests, ray-cast from a known scene, so that an estimator is accurate on it up
// to the quantisation of the files (disparity to 1/256 px):
//
//   camera   drives ahead by about 0.7 m a frame and turns about the vertical; 1.65 m above the ground
//   static   ground plane, back wall and two side walls, random checks
//   object   label 1: a box on the ground in front of the camera, driving ahead with uneven steps and turning
//
// Depth, flow (without occlusion: also for points that are hidden in the next frame), masks and truth come
// from the same closed-form geometry. Header only: include it in a test that links Sextant::datasets.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/geometry/camera.h"
#include "sextant/geometry/se3.h"

namespace sextant {

struct VdoFixtureOptions {
  int n_frames = 5;
  int first_frame = 0;
  int width = 320;    ///< px
  int height = 96;    ///< px
  bool yaml = true;   ///< write camera.yaml
  bool truth = true;  ///< write pose_gt.txt and object_pose.txt
  double speed = 1;   ///< factor on the motions of camera and object
};

/// The written folder and its truth.
struct VdoFixture {
  std::filesystem::path dir;
  StereoCamera camera;
  double rate_hz = 10;
  std::map<int, SE3> T_world_camera;  ///< by frame number
  std::map<int, SE3> T_world_object;  ///< pose of label 1

  std::string source() const { return "vdo:" + dir.string(); }
};

namespace internal {

constexpr double fixture_ground_y_m = 1.65;

/// Intersection of the ray of one pixel with the scene.
struct FixtureHit {
  double depth_m = std::numeric_limits<double>::infinity();
  int label = 0;
  uint8_t gray = 0;
};

inline uint8_t fixture_check(int surface, double a, double b, double cell_m) {
  const auto cell = [cell_m](double x) {
    return static_cast<uint32_t>(static_cast<int>(std::floor(x / cell_m)));
  };
  uint32_t h = cell(a) * 73856093u ^ cell(b) * 19349663u ^ static_cast<uint32_t>(surface) * 83492791u;
  h = (h ^ (h >> 13)) * 0x5bd1e995u;
  return static_cast<uint8_t>(20 + (h ^ (h >> 15)) % 216);
}

/// Returns the depth s at which the ray o + s d (d.z = 1 in camera coordinates) intersects the plane p[axis]
/// = at.
inline double fixture_plane(const Eigen::Vector3d& o, const Eigen::Vector3d& d, int axis, double at) {
  const double s = (at - o[axis]) / d[axis];
  return s > 1e-6 && std::isfinite(s) ? s : std::numeric_limits<double>::infinity();
}

inline FixtureHit fixture_hit(const Eigen::Vector3d& ray, const SE3& T_world_camera,
                              const SE3& T_world_object) {
  FixtureHit hit;
  const Eigen::Vector3d o = T_world_camera.translation();
  const Eigen::Vector3d d = T_world_camera.rotation() * ray;
  struct Plane {
    int axis;
    double at, cell_m;
  };
  const Plane planes[] = {{2, 40.0, 2.0}, {1, fixture_ground_y_m, 0.5}, {0, -8.0, 1.2}, {0, 8.0, 1.2}};
  for (int i = 0; i < 4; ++i) {
    const double s = fixture_plane(o, d, planes[i].axis, planes[i].at);
    if (!(s < hit.depth_m)) continue;
    const Eigen::Vector3d p = o + s * d;
    hit = {s, 0,
           fixture_check(i, p[(planes[i].axis + 1) % 3], p[(planes[i].axis + 2) % 3], planes[i].cell_m)};
  }
  // The box in its own coordinates: x right, y down (bottom at 0), z ahead.
  const SE3 T_object_world = T_world_object.inverse();
  const Eigen::Vector3d box_o = T_object_world * o;
  const Eigen::Vector3d box_d = T_object_world.rotation() * d;
  const Eigen::Vector3d low(-0.9, -1.5, -2.0), high(0.9, 0.0, 2.0);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double at : {low[axis], high[axis]}) {
      const double s = fixture_plane(box_o, box_d, axis, at);
      if (!(s < hit.depth_m)) continue;
      const Eigen::Vector3d p = box_o + s * box_d;
      const int a = (axis + 1) % 3;
      const int b = (axis + 2) % 3;
      if (p[a] < low[a] || p[a] > high[a] || p[b] < low[b] || p[b] > high[b]) continue;
      hit = {s, 1, fixture_check(10 + axis, p[a], p[b], 0.3)};
    }
  }
  return hit;
}

/// Returns a pose with a rotation about the vertical (y, down) and a position.
inline SE3 fixture_pose(double yaw_rad, double x_m, double y_m, double z_m) {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY())), {x_m, y_m, z_m});
}

inline void fixture_tracks(const VdoFixtureOptions& options, VdoFixture& fixture) {
  SE3 camera = fixture_pose(0.0, 0.0, 0.0, 0.0);
  SE3 object = fixture_pose(0.05, 1.2, fixture_ground_y_m, 9.0);
  for (int i = 0; i < options.n_frames; ++i) {
    fixture.T_world_camera[options.first_frame + i] = camera;
    fixture.T_world_object[options.first_frame + i] = object;
    const double k = options.speed;
    camera = camera * fixture_pose(k * (0.008 - 0.003 * (i % 3)), k * 0.02 * (i % 2), 0.0,
                                   k * (0.70 + 0.05 * (i % 2)));
    object = object * fixture_pose(k * (-0.02 + 0.006 * (i % 2)), 0.0, 0.0, k * (0.85 + 0.04 * (i % 3)));
  }
}

inline void fixture_frame(const VdoFixture& fixture, int frame, int width, int height,
                          std::string& object_rows) {
  const SE3& T_world_camera = fixture.T_world_camera.at(frame);
  const SE3& T_world_object = fixture.T_world_object.at(frame);
  const bool last = !fixture.T_world_camera.contains(frame + 1);
  SE3 T_next_camera, T_next_camera_object;  // for points at rest, and for points that move with the object
  if (!last) {
    const SE3 T_next_world = fixture.T_world_camera.at(frame + 1).inverse();
    T_next_camera = T_next_world * T_world_camera;
    T_next_camera_object =
        T_next_world * fixture.T_world_object.at(frame + 1) * T_world_object.inverse() * T_world_camera;
  }

  Image<Rgb> image(width, height);
  Image<float> depth(width, height);
  Image<Flow> flow(width, height);
  Image<uint16_t> mask(width, height);
  int left = width, top = height, right = -1, bottom = -1;
  for (const auto [x, y] : PixelRange(width, height)) {
    const Eigen::Vector3d ray = fixture.camera.left.ray(x, y);
    const FixtureHit hit = fixture_hit(ray, T_world_camera, T_world_object);
    image(x, y) = {hit.gray, hit.gray, static_cast<uint8_t>(hit.label == 1 ? 255 - hit.gray : hit.gray)};
    depth(x, y) = static_cast<float>(hit.depth_m);
    mask(x, y) = static_cast<uint16_t>(hit.label);
    const Eigen::Vector3d next =
        (hit.label == 1 ? T_next_camera_object : T_next_camera) * (hit.depth_m * ray);
    if (next.z() > 0.1) {
      const Eigen::Vector2d p = fixture.camera.left.project(next);
      flow(x, y) = {static_cast<float>(p.x() - x), static_cast<float>(p.y() - y)};
    }
    if (hit.label != 1) continue;
    left = std::min(left, x);
    right = std::max(right, x);
    top = std::min(top, y);
    bottom = std::max(bottom, y);
  }
  const auto path = [&](const char* folder, const char* extension) {
    return fixture.dir / folder / fmt::format("{:06}.{}", frame, extension);
  };
  write_file(path("image_0", "png"), encode_png(image));
  write_file(path("depth", "png"), encode_png(disparity256_from_depth(depth, fixture.camera.bf)));
  write_file(path("semantic", "txt"), encode_mask_text(mask));
  if (!last) write_file(path("flow", "flo"), encode_flo(flow));
  if (right < 0) return;
  const SE3 T_camera_object = T_world_camera.inverse() * T_world_object;
  const Eigen::Vector3d ahead = T_camera_object.rotation() * Eigen::Vector3d::UnitZ();
  const double ry = std::atan2(ahead.x(), ahead.z()) - std::numbers::pi / 2;
  const Eigen::Vector3d& t = T_camera_object.translation();
  object_rows +=
      fmt::format("{}\t1\t{}\t{}\t{:.6e}\t{:.6e}\t{:.15e}\t{:.15e}\t{:.15e}\t{:.15e}\n", frame, left, top,
                  static_cast<double>(right), static_cast<double>(bottom), t.x(), t.y(), t.z(), ry);
}

}  // namespace internal

/// Writes the folder `dir`, and creates it if needed.
inline VdoFixture make_vdo_fixture(const std::filesystem::path& dir, const VdoFixtureOptions& options = {}) {
  VdoFixture fixture;
  fixture.dir = dir;
  fixture.camera = {{200.0, 200.0, (options.width - 1) / 2.0, (options.height - 1) / 2.0}, 200.0};
  internal::fixture_tracks(options, fixture);
  for (const char* folder : {"image_0", "depth", "flow", "semantic"}) {
    std::filesystem::create_directories(dir / folder);
  }
  std::string object_rows, times;
  for (const auto& [frame, pose] : fixture.T_world_camera) {
    internal::fixture_frame(fixture, frame, options.width, options.height, object_rows);
    times += fmt::format("{:e}\n", frame / fixture.rate_hz);
  }
  write_file(dir / "times.txt", times);
  if (options.yaml) write_file(dir / "camera.yaml", encode_yaml_camera({fixture.camera, fixture.rate_hz}));
  if (options.truth) {
    write_file(dir / "pose_gt.txt", encode_pose_text(fixture.T_world_camera));
    write_file(dir / "object_pose.txt", object_rows);
  }
  return fixture;
}

}  // namespace sextant
