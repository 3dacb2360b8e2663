#pragma once

// A small pair of KITTI scene flow 2015 for tests: 000007, constant colours, disparity 19 then 20 px, flow
// (3, -1).

#include <filesystem>
#include <string>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/png.h"

namespace sextant {

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
