#pragma once

// A small TartanAir V2 trajectory for tests: a wall at 8 m; the camera rotates by 0.01 rad about the vertical
// and moves by (0.1, 0.02, 0.05) m (ahead, right, down) per frame, with exact depth and flow.

#include <bit>
#include <cmath>
#include <filesystem>
#include <string>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/tartanair.h"
#include "sextant/geometry/axes.h"

namespace sextant {

/// Encode depth and flow in the formats of codec/dense_maps.h. Depth is exact; depth that is not finite
/// becomes 0. Flow is rounded to 1/64 px; flow that is invalid or outside the range of the format gets the
/// mask 1.
inline Image<Rgba> tartanair_from_depth(const Image<float>& depth_m) {
  return image_of(depth_m.width(), depth_m.height(), [&](int x, int y) {
    const float z = depth_m(x, y);
    const auto bits = std::bit_cast<uint32_t>(std::isfinite(z) ? z : 0.0f);
    const auto byte = [&](int i) { return static_cast<uint8_t>(bits >> (8 * i)); };
    return Rgba{byte(2), byte(1), byte(0), byte(3)};
  });
}

inline Image<Rgb16> tartanair_from_flow(const Image<Flow>& flow) {
  return image_of(flow.width(), flow.height(), [&](int x, int y) {
    const Flow f = flow(x, y);
    const double u = std::round(64.0 * f.u + 32768.0), v = std::round(64.0 * f.v + 32768.0);
    if (!(u >= 0 && u <= 65535 && v >= 0 && v <= 65535)) return Rgb16{1, 0, 0};
    return Rgb16{0, static_cast<uint16_t>(v), static_cast<uint16_t>(u)};
  });
}

/// Writes `n` frames; returns the camera truth, T_world_camera in opencv axes.
inline SequenceTruth write_tartanair_trajectory(const std::filesystem::path& folder, int n) {
  const auto put = [&](const std::string& name, std::string_view bytes) {
    std::filesystem::create_directories((folder / name).parent_path());
    write_file(folder / name, bytes);
  };
  const auto pose_ned = [](int frame) {
    const double yaw = 0.01 * frame;
    return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
               Eigen::Vector3d(0.1, 0.02, 0.05) * frame + Eigen::Vector3d(3, -2, 1));
  };
  const SE3 T_opencv_ned(Eigen::Quaterniond(opencv_from_axes(Axes::ned)), Eigen::Vector3d::Zero());
  const PinholeCamera camera{tartanair_focal_px, tartanair_focal_px, tartanair_size_px / 2.0,
                             tartanair_size_px / 2.0};
  constexpr int size = tartanair_size_px;
  SequenceTruth truth;
  std::string poses;
  for (int k = 0; k < n; ++k) {
    const SE3 pose = pose_ned(k);
    truth.camera.set(k, T_opencv_ned * pose * T_opencv_ned.inverse());
    truth.objects[k] = {};
    const auto& p = pose.translation();
    const auto& q = pose.rotation();
    poses += fmt::format("{} {} {} {} {} {} {}\n", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  }
  put("pose_lcam_front.txt", poses);
  const double wall_m = truth.camera.pose(0)->translation().z() + 8;
  for (int k = 0; k < n; ++k) {
    const SE3 T_world_camera = *truth.camera.pose(k);
    const auto depth = [&](int x, int y) {
      const Eigen::Vector3d ray = T_world_camera.rotation() * camera.ray(x, y);
      return static_cast<float>((wall_m - T_world_camera.translation().z()) / ray.z());
    };
    Image<float> depth_m = image_of(size, size, depth);
    depth_m(1, 2) = 40800;  // sky
    put(fmt::format("image_lcam_front/{:06}_lcam_front.png", k),
        encode_png(Image<Rgb>(size, size, {90, 90, 90})));
    put(fmt::format("image_rcam_front/{:06}_rcam_front.png", k),
        encode_png(Image<Rgb>(size, size, {90, 90, 90})));
    put(fmt::format("depth_lcam_front/{:06}_lcam_front_depth.png", k),
        encode_png(tartanair_from_depth(depth_m), {.level = 1, .filter = 0}));
    if (k + 1 == n) continue;
    const SE3 T_next_camera = truth.camera.pose(k + 1)->inverse() * T_world_camera;
    Image<Flow> flow = image_of(size, size, [&](int x, int y) {
      const Eigen::Vector2d q = camera.project(T_next_camera * camera.backproject(x, y, depth(x, y)));
      return Flow{static_cast<float>(q.x() - x), static_cast<float>(q.y() - y)};
    });
    flow(3, 4) = {};
    put(fmt::format("flow_lcam_front/{:06}_{:06}_flow.png", k, k + 1),
        encode_png(tartanair_from_flow(flow), {.level = 1, .filter = 0}));
  }
  return truth;
}

}  // namespace sextant
