#pragma once

// VDO-SLAM folders: the layout `vdo` that writes them, and the adapter `vdo` that reads them.
//
// The layout writes a sequence as such a folder, OUT itself or OUT/<sequence> if a name is given:
//
//   image_0/%06d.png    RGB              depth/%06d.png      disparity * 256, z = bf / (n / 256)
//   flow/%06d.flo       to the next      semantic/%06d.txt   instance ids
//   camera.yaml         f, c, bf, fps    times.txt           line k: time of frame k, s (from frame 0 on)
//   pose_gt.txt         truth, if known; object_pose.txt likewise
//
// Frames keep their numbers. The format does not store depth nearer than bf / 255.99, disparity steps finer
// than 1/256 px, and roll and pitch of objects; objects without a 2-D box get an empty one. Channels that the
// source lacks are left out.

#include <memory>
#include <string>
#include <string_view>

#include "sextant/datasets/folder_sequence.h"
#include "sextant/datasets/layout.h"

namespace sextant {

/// Implements Layout::write of layout.h. Also throws Error for frame numbers above 999999.
std::string write_vdo_layout(const Sequence& sequence, const LayoutRequest& request);

// Adapter `vdo`: folders of the multimot / VDO-SLAM data set (KITTI tracking with network outputs).
//
//   image_0/%06d.png (or image/)  8-bit RGB or gray
//   depth/%06d.png                16-bit, disparity * 256; depth = bf / (n / 256) m, 0 = invalid
//   flow/%06d.flo                 Middlebury, px, to the next frame; the last frame needs none
//   semantic/%06d.txt             instance ids as text, 0 = background, label = KITTI track id + 1
//   *.yaml                        OpenCV YAML camera; if absent, that of KITTI 0003, with a warning, if the
//                                 images have 1242x375 pixels; other images need the options fx, fy, cx, cy
//                                 and bf
//   pose_gt.txt                   truth, optional: frame + 4x4 matrix camera -> world
//   object_pose.txt               truth, optional: frame id l t r b x y z ry; box (px), position (m) and
//                                 yaw (rad) in the camera: T_camera_object = (Ry(ry + pi/2), (x, y, z))
//   times.txt                     time stamps of the frames, s; steps that contradict the rate are a warning
//                                 only: the authors' file has 0.05 s steps for 10 Hz data
//
// Options flow, depth and masks replace the folder's own (channels/channel_source.h).
//
// Frames: all with an image, which must be consecutive, or @first-last. Source: github.com/halajun/VDO_SLAM.

enum class VdoPair { authors, colour };
constexpr Names<2> names_of(VdoPair) { return {"authors", "colour"}; }

struct VdoFolderOptions : ChannelOptions {
  SEXTANT_OPTIONS_OF(
      ChannelOptions, (double, rate_hz, 0, "Hz", "frame rate; 0 = Camera.fps of the folder's yaml, else 10"),
      (double, fx, 0, "px", "focal length; 0 = from the folder"),
      (double, fy, 0, "px", "focal length; 0 = from the folder"),
      (double, cx, 0, "px", "principal point; 0 = from the folder"),
      (double, cy, 0, "px", "principal point; 0 = from the folder"),
      (double, bf, 0, "px m", "focal length times baseline; 0 = from the folder"),
      (VdoPair, bf_preset, VdoPair::authors, "",
       "authors = as in the folder (KITTI 0003: the grey pair's 387.57); colour = KITTI 0003's colour pair, "
       "384.38"))
  void check() const;
};

/// Throws Error on a folder, file or frame range that is missing, or a file that is not as described above.
std::unique_ptr<Sequence> open_vdo_folder(const SourceSpec& source);

/// Decodes object_pose.txt: "frame id l t r b x y z ry" per line. Returns the objects by frame, ordered by
/// id, with `interpolated` set. Throws Error "NAME:LINE: ..." on another number of values, values that are
/// not finite, an id outside 1..65535, or an object that is repeated in a frame.
ObjectTruths decode_vdo_objects(std::string_view text, const std::string& name);

}  // namespace sextant
