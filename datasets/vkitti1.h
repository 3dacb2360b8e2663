#pragma once

// Virtual KITTI 1.3.1: its ground truth, and the adapter `vkitti1`.
//
// The ground truth of Virtual KITTI 1.3.1, from its text files only. The files are found in any of these
// places below a root (<v> is the variation, such as "clone"):
//
//   vkitti_1.3.1_{extrinsicsgt,motgt}/<world>_<v>.txt    the official archives
//   vkitti_1.3.1_motgt/vkitti_1.3.1_motgt/...            each archive unpacked into a folder of its own name
//   vkitti_1.3.1_text/<world>_{camera,objects}.txt       clone only; or the two files in the root itself
//
// Result: T_world_camera = inverse of the extrinsics. For each object with id = tid + 1: T_camera_object,
// with its origin in the middle of the box's bottom face and the rotation of vkitti_text.h; size_m = (w3d,
// h3d, l3d); type = orig_label; and the box. `moving` is taken from its column, except for the value 0 in
// worlds other than 0001 and 0002, whose zeros include rolling cars: there moves() of vkitti_layout.h
// decides.

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

/// Text files of one world and variation; empty paths: not found.
struct Vkitti1TextFiles {
  std::filesystem::path extrinsics;
  std::filesystem::path objects;
};

/// Returns the folder of one archive ("motgt") below `root`, if it exists.
std::optional<std::filesystem::path> vkitti1_folder(const std::filesystem::path& root,
                                                    const std::string& kind);

/// Return the worlds of which any file exists ("0001"), and the variations of one world ("clone").
std::set<std::string> vkitti1_worlds(const std::filesystem::path& root);
std::set<std::string> vkitti1_variations(const std::filesystem::path& root, const std::string& world);

Vkitti1TextFiles find_vkitti1_text(const std::filesystem::path& root, const std::string& world,
                                   const std::string& variation);

struct Vkitti1Truth {
  SequenceTruth truth;
  std::vector<std::string> warnings;  ///< missing files, one line each
};

/// Reads the existing files; a missing file is a warning. Throws Error on a damaged file, and on objects in
/// frames without extrinsics.
Vkitti1Truth read_vkitti1_truth(const Vkitti1TextFiles& files, const std::string& world, InputLog& inputs);
/// Overload that requires the truth: throws Error if the world, the variation or either file is missing.
Vkitti1Truth read_vkitti1_truth(const std::filesystem::path& root, const std::string& world,
                                const std::string& variation, InputLog& inputs);

/// Throws Error with the available worlds, or variations, if the sequence does not exist.
void require_vkitti1_sequence(const std::filesystem::path& root, const std::string& world,
                              const std::string& variation);

// Adapter `vkitti1`: Virtual KITTI 1.3.1. SOURCE is vkitti1:ROOT#<world>/<variation>[@first-last], such as
// vkitti1:ROOT#0018/clone; #0018 means #0018/clone. ROOT contains any subset of the unpacked archives:
//
//   vkitti_1.3.1_rgb/<world>/<variation>/%05d.png    8-bit RGB
//   vkitti_1.3.1_depthgt/...                         16-bit, cm; 65535 = sky or beyond 655.34 m
//   vkitti_1.3.1_flowgt/...                          16-bit RGB (codec/dense_maps.h); none for the last frame
//   vkitti_1.3.1_scenegt/...                         8-bit RGB; colours in *_scenegt_rgb_encoding.txt
//   vkitti_1.3.1_extrinsicsgt, vkitti_1.3.1_motgt    text files; see above for alternative places
//
// An archive may also lie in a folder of its own name. Ids in masks and truth are track ids + 1; all
// categories without a track are 0, the background. With text files only, there are poses and objects, and no
// channels. Camera: f = 725 px, c = (620.5, 187), 1242x375. There is no second camera: bf is that of Virtual
// KITTI 2 (0.532725 m), for models of depth noise. Source: europe.naverlabs.com/proxy-virtual-worlds-vkitti-1

inline constexpr double vkitti1_focal_px = 725.0;
inline constexpr double vkitti_baseline_m = 0.532725;

struct Vkitti1Options : RatedChannelOptions {
  SEXTANT_OPTIONS_OF(
      RatedChannelOptions,
      (double, bf, vkitti1_focal_px* vkitti_baseline_m, "px m",
       "focal length times baseline, for models of stereo depth noise only: there is no second camera"))
  void check() const;
};

/// Throws Error on a world, variation, file or frame range that is missing, or a file that is not as
/// described.
std::unique_ptr<Sequence> open_vkitti1(const SourceSpec& source);

}  // namespace sextant
