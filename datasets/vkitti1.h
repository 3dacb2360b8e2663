#pragma once

// Virtual KITTI 1.3.1: its ground truth, and the adapter `vkitti1`.
//
// The ground truth of Virtual KITTI 1.3.1, from its text files alone. Found below a root in any of these
// places (<v> the variation, such as "clone"):
//
//   vkitti_1.3.1_{extrinsicsgt,motgt}/<world>_<v>.txt    the official archives
//   vkitti_1.3.1_motgt/vkitti_1.3.1_motgt/...            each unpacked into a folder of its own name
//   vkitti_1.3.1_text/<world>_{camera,objects}.txt       clone only; or these in the root itself
//
// Result: T_world_camera = inverse of the extrinsics; per object id = tid + 1, T_camera_object with the
// middle of the box's bottom face and vkitti_text.h's rotation, size_m = (w3d, h3d, l3d), type = orig_label,
// and the box. `moving` is the column; where it is 0 in other worlds than 0001 and 0002, whose zeros
// include cars that roll, the step to the next frame decides.

#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/folder_sequence.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// Where the texts of one world and variation are; empty paths: not there.
struct Vkitti1TextFiles {
  std::filesystem::path extrinsics;
  std::filesystem::path objects;
};

/// The folder of one archive ("motgt") below `root`, if it is there.
std::optional<std::filesystem::path> vkitti1_folder(const std::filesystem::path& root,
                                                    const std::string& kind);

/// Worlds of which anything is there ("0001"), and variations of one of them ("clone").
std::set<std::string> vkitti1_worlds(const std::filesystem::path& root);
std::set<std::string> vkitti1_variations(const std::filesystem::path& root, const std::string& world);

Vkitti1TextFiles find_vkitti1_text(const std::filesystem::path& root, const std::string& world,
                                   const std::string& variation);

struct Vkitti1Truth {
  SequenceTruth truth;
  std::vector<std::string> warnings;  ///< what is missing or not to be trusted, one line each
};

/// Reads what is there; a file that is not gives a warning. Throws Error on a damaged file, and on objects in
/// frames that have no extrinsics.
Vkitti1Truth read_vkitti1_truth(const Vkitti1TextFiles& files, const std::string& world, InputLog& inputs);
/// The same, for who only needs the truth: throws Error when the world, the variation or either file is not
/// there.
Vkitti1Truth read_vkitti1_truth(const std::filesystem::path& root, const std::string& world,
                                const std::string& variation, InputLog& inputs);

/// Throws Error that names the worlds, or variations, that are there.
void require_vkitti1_sequence(const std::filesystem::path& root, const std::string& world,
                              const std::string& variation);

// Adapter `vkitti1`: Virtual KITTI 1.3.1. SOURCE is vkitti1:ROOT#<world>/<variation>[@first-last], such as
// vkitti1:ROOT#0018/clone; #0018 alone is its clone. ROOT holds the unpacked archives, any subset of them:
//
//   vkitti_1.3.1_rgb/<world>/<variation>/%05d.png    8-bit RGB
//   vkitti_1.3.1_depthgt/...                         16-bit, cm; 65535 = sky or beyond 655.34 m
//   vkitti_1.3.1_flowgt/...                          16-bit RGB (codec/kitti_png.h); none of the last frame
//   vkitti_1.3.1_scenegt/...                         8-bit RGB; colours in *_scenegt_rgb_encoding.txt
//   vkitti_1.3.1_extrinsicsgt, vkitti_1.3.1_motgt    text: see above, also for other places of it
//
// An archive may also lie in a folder of its own name. Ids in masks and truth are track ids + 1; all
// categories without a track are 0, the background. With the text alone there are poses and objects, and no
// channels. Camera: f = 725 px, c = (620.5, 187), 1242x375. There is no second camera: bf is that of Virtual
// KITTI 2 (0.532725 m), for models of depth noise. Source: europe.naverlabs.com/proxy-virtual-worlds-vkitti-1

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
