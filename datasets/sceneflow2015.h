#pragma once

// Adapter `sceneflow`: the training pairs of KITTI scene flow 2015. SOURCE is sceneflow:ROOT#000002; ROOT (or
// ROOT/training) holds, for each pair,
//
//   image_2/%06d_10.png, _11.png    left colour images of frames 10 and 11
//   image_3/%06d_10.png, _11.png    right colour images
//   calib_cam_to_cam/%06d.txt       P_rect_02, P_rect_03 (also found in calib_cam/)
//   disp_occ_0/%06d_10.png          true disparity of frame 10, 16-bit, n / 256 px, 0 = none
//   disp_occ_1/%06d_10.png          true disparity of frame 11 at the pixels of frame 10
//   flow_occ/%06d_10.png            true flow from frame 10 to 11, 16-bit RGB, (n - 2^15) / 64 px, B = 0 =
//                                   none
//
// The truth is the reference of a run: by default flow and depth are computed from the images. The true depth
// of frame 11 is disp_occ_1, moved along the true flow to the nearest pixel; the nearest surface wins, and
// there are holes. There are no poses, and no masks unless an option provides them.
// Source: cvlibs.net/datasets/kitti/eval_scene_flow.php (Menze and Geiger, CVPR 2015).

#include <memory>

#include "sextant/datasets/dataset.h"

namespace sextant {

struct SceneFlow2015Options {
  SEXTANT_OPTIONS(
      (std::string, depth, "auto", "",
       "auto = sgbm; truth = that of the data set; or disparity256:DIR, depth256:DIR, cm:DIR"),
      (std::string, flow, "auto", "",
       "auto = dis; truth = that of the data set; or flo:DIR, kitti_png:DIR, vkitti_png:DIR, onnx:FILE"),
      (std::string, masks, "none", "",
       "none; or instance_png:DIR, mots_png:DIR, mots_txt:FILE, vdo_text:DIR, onnx:FILE"))
};

/// Throws Error on a folder, pair or file that is missing, or a file that is not as described above.
std::unique_ptr<Sequence> open_sceneflow2015(const SourceSpec& source);

/// Returns `next_depth_m`, the depth of the next frame at the pixels of this one, moved to the pixels of the
/// next frame by `flow`; declared for its test.
Image<float> carry_depth_along_flow(const Image<float>& next_depth_m, const Image<Flow>& flow);

}  // namespace sextant
