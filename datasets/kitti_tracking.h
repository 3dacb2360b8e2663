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

#include <cstdint>
#include <memory>
#include <vector>

#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/folder_sequence.h"
#include "sextant/datasets/kitti_truth.h"
#include "sextant/datasets/layout.h"

namespace sextant {

struct KittiTrackingOptions : KittiTruthOptions, RatedChannelOptions {
  void visit(auto& v) {
    KittiTruthOptions::visit(v);
    RatedChannelOptions::visit(v);
  }
  void check() const;
};

/// Throws Error on folders, files or frames that are missing or not as described.
std::unique_ptr<Sequence> open_kitti_tracking(const SourceSpec& source);

// ---- GPS/IMU samples along a camera trajectory, as the receiver in the car would record them: the inverse
// of kitti_truth.h.
//
//   T_map_imu(k) = W T_world_camera(k) T_camera_imu,  W: world axes (x right, y down, z ahead) -> map (x
//   east, y north, z up), then moved so that the first sample lies at 49.011 N, 8.4229 E, 112 m
//
// Sample k is taken at time k / rate + jitter_k, jitter_k normal with mean 0. Between frames, positions
// follow the twice continuously differentiable cubic spline through the poses whose first and last segments
// are parabolas, and rotations have a constant rate from one frame to the next; without jitter the samples
// are the poses of the frames. Speeds are the derivative of the spline at the time of the sample.

struct OxtsJitter {
  double sigma_s = 0;  ///< standard deviation of the sample's time relative to the image's
  uint64_t seed = 1;   ///< the jitter of a frame is a function of (seed, frame) only
};

/// Returns one sample per pose. Values that poses do not determine (accelerations, turn rates, receiver
/// state) are 0.
std::vector<KittiOxts> oxts_of_track(const std::vector<SE3>& T_world_camera, double rate_hz,
                                     const SE3& T_camera_imu, const OxtsJitter& jitter = {});

// ---- Layout `kitti`: writes a sequence in the format of KITTI tracking below OUT/training, with MOTS masks
// and three additions that the data set lacks: depth_02, flow_02 (see above) and object_pose
// (codec/pose_text.h). Channels that the source lacks are left out.
//
// Frames are numbered from 0 regardless of their numbers in the source, because lines of oxts are not
// numbered. The calibration has R_rect = I and camera 2 = camera 0, so that both values of ground_truth give
// the same poses.
//
// Information that the format does not store:
//   - the world frame: poses come back relative to the first one
//   - roll and pitch of objects, except in object_pose: rotation_y of label_02 is the heading of their z
//     axis; without object_pose an object that is tilted by e against the camera's vertical comes back turned
//     by at most about e (its position is exact)
//   - depth beyond 255.99 m and steps finer than 1/256 m; flow beyond 512 px and steps finer than 1/64 px
//   - backward flow, occlusion, and the `moving` flag of objects
//   - rates other than 10 Hz: an Error

struct KittiLayoutOptions {
  SEXTANT_OPTIONS((double, oxts_jitter_ms, 0, "ms",
                   "standard deviation of the GPS/IMU sample's time against the image (KITTI: about 5)"),
                  (uint64_t, seed, 1, "", "seed of the jitter"))
  void check() const;
};

/// Implements Layout::write of layout.h. Also throws Error for a frame rate other than 10 Hz, a frame without
/// camera pose if others have one, an object without box or size or with blanks in its type, and an id
/// outside 1..1000, the range of MOTS.
std::string write_kitti_layout(const Sequence& sequence, const LayoutRequest& request);

}  // namespace sextant
