#pragma once

// Adapter `sceneflow`: the training pairs of KITTI scene flow 2015. SOURCE is sceneflow:ROOT#000002; ROOT (or
// ROOT/training) holds, for each pair,
//
//   image_2/%06d_10.png, _11.png    left colour images of frames 10 and 11
//   image_3/%06d_10.png, _11.png    right colour images
//   calib_cam_to_cam/%06d.txt       P_rect_02, P_rect_03 (also found in calib_cam/)
//   disp_occ_0/%06d_10.png          true disparity of frame 10, 16-bit, n / 256 px, 0 = none
//   disp_occ_1/%06d_10.png          that of frame 11, but at the pixels of frame 10
//   flow_occ/%06d_10.png            true flow from frame 10 to 11, 16-bit RGB, (n - 2^15) / 64 px, B = 0 =
//                                   none
//
// The truth is what a run is measured with: flow and depth are computed from the images unless told
// otherwise. The true depth of frame 11 is disp_occ_1 carried along the true flow to the nearest pixel, the
// nearest surface in front; it has holes. There are no poses, and no masks unless an option gives them.
// Source: cvlibs.net/datasets/kitti/eval_scene_flow.php (Menze and Geiger, CVPR 2015).

#include <memory>

#include "sextant/datasets/dataset.h"

namespace sextant {

struct SceneFlow2015Options {
  SEXTANT_OPTIONS(
      (std::string, depth, "auto", "",
       "auto = sgbm; truth = the data set's; or disparity256:DIR, depth256:DIR, cm:DIR"),
      (std::string, flow, "auto", "",
       "auto = dis; truth = the data set's; or flo:DIR, kitti_png:DIR, vkitti_png:DIR, onnx:FILE"),
      (std::string, masks, "none", "",
       "none; or instance_png:DIR, mots_png:DIR, mots_txt:FILE, vdo_text:DIR, onnx:FILE"))
};

/// Throws Error on a folder, pair or file that is not there, or a file that is not as described above.
std::unique_ptr<Sequence> open_sceneflow2015(const SourceSpec& source);

/// Both disparities as depth, the second at the pixels that `flow` leads to; exposed for its test.
Image<float> carry_depth_along_flow(const Image<float>& next_depth_m, const Image<Flow>& flow);

}  // namespace sextant
