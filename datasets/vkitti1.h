#pragma once

// Adapter `vkitti1`: Virtual KITTI 1.3.1. SOURCE is vkitti1:ROOT#<world>/<variation>[@first-last], such as
// vkitti1:ROOT#0018/clone; #0018 alone is its clone. ROOT holds the unpacked archives, any subset of them:
//
//   vkitti_1.3.1_rgb/<world>/<variation>/%05d.png    8-bit RGB
//   vkitti_1.3.1_depthgt/...                         16-bit, cm; 65535 = sky or beyond 655.34 m
//   vkitti_1.3.1_flowgt/...                          16-bit RGB (codec/kitti_png.h); none of the last frame
//   vkitti_1.3.1_scenegt/...                         8-bit RGB; colours in *_scenegt_rgb_encoding.txt
//   vkitti_1.3.1_extrinsicsgt, vkitti_1.3.1_motgt    text: see vkitti1_truth.h, also for other places of it
//
// An archive may also lie in a folder of its own name. Ids in masks and truth are track ids + 1; all
// categories without a track are 0, the background. With the text alone there are poses and objects, and no
// channels. Camera: f = 725 px, c = (620.5, 187), 1242x375. There is no second camera: bf is that of Virtual
// KITTI 2 (0.532725 m), for models of depth noise. Source: europe.naverlabs.com/proxy-virtual-worlds-vkitti-1

#include <memory>

#include "sextant/datasets/folder_sequence.h"

namespace sextant {

inline constexpr double vkitti1_focal_px = 725.0;
inline constexpr double vkitti_baseline_m = 0.532725;

struct Vkitti1Options : ChannelOptions {
  SEXTANT_OPTIONS_OF(ChannelOptions,
      (double, rate_hz, 10, "Hz", "frame rate"),
      (double, bf, vkitti1_focal_px * vkitti_baseline_m, "px m",
       "focal length times baseline, for models of stereo depth noise only: there is no second camera"))
  void check() const;
};

/// Throws Error on a world, variation, file or frame range that is not there, or a file that is not as
/// described.
std::unique_ptr<Sequence> open_vkitti1(const SourceSpec& source);

}  // namespace sextant
