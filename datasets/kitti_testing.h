#pragma once

// A small in-memory sequence with everything that the KITTI layout can represent, for tests of its writer and
// adapter. The values are patterns without a scene, since they only have to be read back. And the text files
// of a car that drives straight ahead.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/kitti_tracking.h"
#include "sextant/datasets/testing.h"

namespace sextant {

class PatternSequence final : public MemorySequence {
 public:
  explicit PatternSequence(int n_frames, int first_frame = 0, bool images = true) {
    info_.dataset = "pattern";
    info_.sequence = "p7";
    info_.camera = {{120, 121, 80, 24}, 60};
    info_.rate_hz = 10;
    info_.width = 160;
    info_.height = 48;
    info_.first_frame = first_frame;
    info_.last_frame = first_frame + n_frames - 1;
    if (images) info_.channels = Channels::all();
    SE3 pose = SE3::exp({3, -1, 2, 0.1, 0.4, -0.05});  // not the identity, which no source guarantees
    for (int frame = first_frame; frame <= info_.last_frame; ++frame) {
      truth_.camera.set(frame, pose);
      pose = pose * SE3::exp({0.02, -0.01, 1.0 + 0.02 * std::sin(0.3 * frame), 0.002, 0.01, -0.001});
      truth_.objects[frame] = {object(1, "Car", frame, {-2.5, 1.5, 12}, {1.6, 1.5, 4.2}),
                               object(4, "Pedestrian", frame, {3, 1.6, 8}, {0.6, 1.8, 0.7})};
    }
  }

  Frame read(int frame, Channels channels) const override {
    Frame out;
    out.index = frame;
    const auto fill = [&](auto& image, auto value) { image = image_of(info_.width, info_.height, value); };
    const auto texture = [](int x, int y) {
      return static_cast<uint8_t>(((x / 3) * 73 ^ (y / 3) * 151 ^ (x / 3) * (y / 3) * 29) % 256);
    };
    if (channels.rgb)
      fill(out.rgb, [&](int x, int y) { return Rgb{texture(x + frame, y), texture(x + frame, y + 40), 7}; });
    if (channels.rgb_right)
      fill(out.rgb_right, [&](int x, int y) {
        return Rgb{texture(x + frame + 5, y), texture(x + frame + 5, y + 40), 7};
      });
    if (channels.depth)
      fill(out.depth_m, [&](int x, int y) { return y < 5 ? NAN : 2.0f + 0.37f * x + 0.0113f * y + frame; });
    if (channels.flow && frame != info_.last_frame)
      fill(out.flow, [&](int x, int y) { return y < 5 ? Flow{} : Flow{-20.3f + 0.31f * x, 0.017f * y}; });
    if (channels.backward_flow && frame != info_.first_frame)
      fill(out.backward_flow, [&](int x, int y) { return Flow{20.3f - 0.31f * x, 0.017f * y}; });
    if (channels.mask)
      fill(out.mask, [&](int x, int y) -> uint16_t {
        if (y < 10 || y > 30) return 0;
        return x > 20 + frame && x < 60 ? 1 : x > 100 && x < 110 + frame ? 4 : 0;
      });
    return out;
  }

 private:
  static ObjectTruth object(int id, const char* type, int frame, const Eigen::Vector3d& at,
                            const Eigen::Vector3d& size_m) {
    ObjectTruth o{.id = id, .size_m = size_m, .type = type};
    const double yaw = 0.4 * id + 0.37 * frame;  // exceeds a full turn, so that rotation_y wraps
    const Eigen::Vector3d move(0.01 * frame * frame, 0.001 * frame, 0.11 * frame);
    o.T_camera_object = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())), at + move);
    o.box =
        id == 1 ? ImageBox{std::min(21.0 + frame, 55.0), 10, 59, 30} : ImageBox{101, 10, 109.0 + frame, 30};
    return o;
  }
};

/// Returns calib/NNNN.txt of a camera at the GPS/IMU unit that looks ahead; `bf` in px m.
inline std::string calibration_of_car(double f_px, double cx_px, double cy_px, double bf) {
  std::string text;
  for (int camera = 0; camera < 4; ++camera) {
    text += fmt::format("P{}: {} 0 {} {} 0 {} {} 0 0 0 1 0\n", camera, f_px, cx_px,
                        camera % 2 == 0 ? 0.0 : -bf, f_px, cy_px);
  }
  return text +
         "R_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam 0 -1 0 0 0 0 -1 0 1 0 0 0\nTr_imu_velo 1 0 0 0 0 1 0 0 0 0 1 "
         "0\n";
}

/// Returns samples of oxts at the positions x_m, all with the speed 10 m/s.
inline std::vector<KittiOxts> straight_drive(const std::vector<double>& x_m) {
  std::vector<KittiOxts> samples;
  for (const double x : x_m) {
    samples.push_back(oxts_from_pose(SE3(Eigen::Quaterniond::Identity(), {x, 0, 0}), 1));
    samples.back().velocity_mps.x() = samples.back().east_mps = 10;
  }
  return samples;
}

// ---- A small pair of KITTI scene flow 2015 for tests: 000007, constant colours, disparity 19 then 20 px,
// flow (3, -1).

inline constexpr int sceneflow_width = 48;
inline constexpr int sceneflow_height = 32;
inline constexpr const char* sceneflow_calibration =
    "calib_time: 09-Jan-2012 13:57:47\n"
    "P_rect_02: 700 0 24 40 0 701 16 0.2 0 0 1 0\n"
    "P_rect_03: 700 0 24 -340 0 701 16 2 0 0 1 0\n";

inline void write_sceneflow_pair(const std::filesystem::path& root) {
  const auto put = [&](const std::string& name, std::string_view bytes) {
    std::filesystem::create_directories((root / name).parent_path());
    write_file(root / name, bytes);
  };
  const Image<Rgb> image(sceneflow_width, sceneflow_height, {90, 90, 90});
  Image<uint16_t> disparity(sceneflow_width, sceneflow_height, 19 * 256);
  disparity(5, 5) = 0;
  put("calib_cam_to_cam/000007.txt", sceneflow_calibration);
  for (const char* name :
       {"image_2/000007_10.png", "image_2/000007_11.png", "image_3/000007_10.png", "image_3/000007_11.png"}) {
    put(name, encode_png(image));
  }
  put("disp_occ_0/000007_10.png", encode_png(disparity));
  put("disp_occ_1/000007_10.png", encode_png(Image<uint16_t>(sceneflow_width, sceneflow_height, 20 * 256)));
  put("flow_occ/000007_10.png",
      encode_png(kitti_from_flow(Image<Flow>(sceneflow_width, sceneflow_height, Flow{3, -1}))));
}

}  // namespace sextant
