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
// and, which the data set does not have but people add (ours: `sextant data make --layout kitti`),
//
//   depth_02/%04d/%06d.png          16-bit, z = n / 256 m, 0 = invalid, as in the KITTI depth benchmark
//   flow_02/%04d/%06d.png           16-bit RGB, (n - 2^15) / 64 px to the next frame, B = 0 invalid
//
// Any part but calib may be missing: without images only the channels that have files can be read, without
// any file the truth alone. Depth and flow are computed where they have no files (channels/channel_source.h).
//
// Frames: all with an image (without images: all with a pose), without a gap, or @first-last.
// Source: cvlibs.net/datasets/kitti/eval_tracking.php.

#include <memory>

#include "sextant/datasets/dataset.h"
#include "sextant/datasets/kitti_truth.h"

namespace sextant {

struct KittiTrackingOptions : KittiTruthOptions {
  double rate_hz = 10;
  std::string depth = "auto";
  std::string flow = "auto";
  std::string masks = "auto";

  template <typename V>
  void visit(V& v) {
    KittiTruthOptions::visit(v);
    v("rate_hz", rate_hz, "Hz", "frame rate");
    v("depth", depth, "",
      "auto = the files of depth_02, else sgbm; none; or sgbm, disparity256:DIR, depth256:DIR, cm:DIR");
    v("flow", flow, "",
      "auto = the files of flow_02, else dis; none; or dis, flo:DIR, kitti_png:DIR, onnx:FILE");
    v("masks", masks, "",
      "auto = instances, else instances_txt; none; or instance_png:DIR, mots_png:DIR, mots_txt:FILE, "
      "vdo_text:DIR, boxes, onnx:FILE");
  }
  void check() const;
};

/// Throws Error on folders, files or frames that are not there or not as described.
std::unique_ptr<Sequence> open_kitti_tracking(const SourceSpec& source);

}  // namespace sextant
