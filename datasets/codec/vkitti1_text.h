#pragma once

// The text files of Virtual KITTI 1.3.1, row by row. Each begins with a row that names the columns.
//
//   extrinsicsgt/<world>_<variation>.txt   frame r1,1 r1,2 r1,3 t1 r2,1 .. t3 0 0 0 1: the 4x4 matrix
//                                          world -> camera, m (some copies mangle the last four names)
//   motgt/<world>_<variation>.txt          one object in one frame per row, see Vkitti1Object
//   scenegt/<world>_<variation>_scenegt_rgb_encoding.txt   Category(:id) r g b: the colours of scenegt/*.png
//
// Decoders accept CRLF, a byte order mark and empty lines, find columns by name, and throw Error "NAME:LINE:
// ..." on columns that are missing (with their names), rows of another length, values that are not finite,
// and on frames, objects of a frame, or colours given twice. Encoders write shortest digits that read back
// the same. Source: europe.naverlabs.com/proxy-virtual-worlds-vkitti-1, the data set's own README.

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/datasets/codec/vkitti_box.h"
#include "sextant/geometry/se3.h"
#include "sextant/measurement/image_box.h"

namespace sextant {

/// One row of motgt. Camera coordinates; m, rad, px.
struct Vkitti1Object {
  int frame = 0;
  int tid = 0;                        ///< track id, unique in a world
  std::string label;                  ///< as KITTI's: "DontCare" for what is hardly to be seen
  int truncated = 0;                  ///< 0, 1, 2: not, partly, heavily
  int occluded = 0;                   ///< 0, 1, 2
  double alpha = 0;                   ///< ry - atan2(x3d, z3d)
  ImageBox box;                       ///< l, t, r, b
  Eigen::Vector3d size_m{0, 0, 0};    ///< of the 3-D box: w3d, h3d, l3d
  Eigen::Vector3d position_m{0, 0, 0};  ///< middle of its bottom face: x3d, y3d, z3d
  VkittiAngles angles;                  ///< ry, rx, rz
  double truncr = 0;                  ///< 0 not truncated .. 1
  double occupr = 0;                  ///< share of the 2-D box that shows the object
  std::string orig_label;             ///< "Car", "Van", "Truck"
  bool moving = false;                ///< 0 is relied on in worlds 0001 and 0002 only
  std::string model, color;           ///< "Sedan4Door", "Silver"
};

/// One row of the colour table of scenegt images.
struct Vkitti1Color {
  std::string category;    ///< "Car", "Building"
  std::optional<int> tid;  ///< what stands after ':'
  Rgb color;
};

/// T_camera_world by frame.
std::map<int, SE3> decode_vkitti1_extrinsics(std::string_view text, const std::string& name);
std::string encode_vkitti1_extrinsics(const std::map<int, SE3>& T_camera_world);

std::vector<Vkitti1Object> decode_vkitti1_objects(std::string_view text, const std::string& name);
std::string encode_vkitti1_objects(const std::vector<Vkitti1Object>& objects);

std::vector<Vkitti1Color> decode_vkitti1_colors(std::string_view text, const std::string& name);
std::string encode_vkitti1_colors(const std::vector<Vkitti1Color>& colors);

}  // namespace sextant
