#pragma once

// Adapter `kitti`: KITTI tracking (and MOTS) as downloaded. SOURCE is kitti:ROOT#0005[@first-last], ROOT
// holds training/ with, for each sequence,
//
//   calib/%04d.txt                  needed
//   image_02/%04d/%06d.png          left colour images
//   image_03/%04d/%06d.png          right colour images
//   oxts/%04d.txt, label_02/%04d.txt   truth (kitti_truth.h)
//   instances/%04d/%06d.png         MOTS masks, or
//   instances_txt/%04d.txt          the same as run lengths
//
// and, in addition to the data set (written by `sextant data make --layout kitti`, for example),
//
//   depth_02/%04d/%06d.png          16-bit, z = n / 256 m, 0 = invalid, as in the KITTI depth benchmark
//   flow_02/%04d/%06d.png           16-bit RGB, (n - 2^15) / 64 px to the next frame, B = 0 invalid
//
// Everything except calib is optional: without images only the channels with files can be read, without any
// files only the truth. Depth and flow are computed if they have no files (channels/channel_source.h).
//
// Frames: all with an image, or @first-last, which must be consecutive. Without images they are those of the
// first folder that exists of depth_02, instances and flow_02; without any of these folders, all samples of
// oxts; without oxts, all frames up to the last label. Source: cvlibs.net/datasets/kitti/eval_tracking.php.

#include <memory>

#include "sextant/datasets/folder_sequence.h"
#include "sextant/datasets/kitti_truth.h"

namespace sextant {

struct KittiTrackingOptions : KittiTruthOptions, ChannelOptions {
  double rate_hz = 10;

  template <typename V>
  void visit(V& v) {
    KittiTruthOptions::visit(v);
    ChannelOptions::visit(v);
    v("rate_hz", rate_hz, "Hz", "frame rate");
  }
  void check() const;
};

/// Throws Error on folders, files or frames that are missing or not as described.
std::unique_ptr<Sequence> open_kitti_tracking(const SourceSpec& source);

}  // namespace sextant
