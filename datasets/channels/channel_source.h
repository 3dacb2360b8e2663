#pragma once

// One channel of a sequence (flow, depth or masks), read from files of a known format or computed from the
// images. Adapters offer the choice as an option with the values in the first column:
//
//   flow    dis                 OpenCV's DIS, medium preset, previous to next image
//           flo:DIR             Middlebury .flo
//           kitti_png:DIR       16-bit PNG, (n - 2^15) / 64 px
//           vkitti_png:DIR      16-bit PNG, (2 n / 65535 - 1)(size - 1) px
//           tartanair_png:DIR   16-bit PNG of TartanAir V2 (codec/tartanair_png.h)
//           onnx:FILE           a network
//   depth   sgbm                OpenCV's semi-global block matching with left-right check
//           disparity256:DIR    16-bit PNG, z = bf / (n / 256)
//           depth256:DIR        16-bit PNG, z = n / 256 m, 0 = invalid (KITTI depth benchmark)
//           cm:DIR              16-bit PNG, z = n / 100 m, 65535 = invalid
//           tartanair_png:DIR   PNG of TartanAir V2, a float32 in four channels (codec/tartanair_png.h)
//   masks   instance_png:DIR    8- or 16-bit gray or palette PNG, the stored number is the id
//           mots_png:DIR        16-bit PNG, class * 1000 + track id; class 10 is ignored; id = track id + 1
//           mots_txt:FILE       "frame id class height width rle" (COCO run lengths); id = track id + 1
//           detections_txt:FILE the same form with arbitrary ids, used unchanged; earlier lines in front
//           vdo_text:DIR        integers as text
//           boxes               the 2-D label boxes, nearer objects in front; the least accurate choice
//           onnx:FILE           a network
//
// A file in DIR belongs to the frame whose number is the first run of digits in its name; DIR/PREFIX* selects
// names that begin with PREFIX, and the number follows the prefix (frame_files.h).

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/geometry/camera.h"
#include "sextant/measurement/frame.h"
#include "sextant/measurement/image.h"

namespace sextant {

/// Inputs from which a channel may be computed.
struct ChannelInputs {
  std::function<Image<Rgb>(int frame)> left;   ///< reads and logs the image of a frame
  std::function<Image<Rgb>(int frame)> right;  ///< empty: the source has no right images
  InputLog* inputs = nullptr;                  ///< logs every file read
  int width = 0;                               ///< px; the size of every channel is checked against it
  int height = 0;
  std::string size_from = "the images";  ///< the file with this size, for messages
  int first_frame = 0;
  int last_frame = 0;  ///< the frame whose flow may be missing
  StereoCamera camera;
};

/// A 2-D label box of one frame, px.
struct LabelBox {
  int id = 0;  ///< as in masks
  ImageBox box;
  double depth_m = 0;  ///< order of overlapping boxes
};

template <typename T>
class ChannelSource {
 public:
  virtual ~ChannelSource() = default;
  /// Reads the channel. Safe to call from several threads. Throws Error that names the file and the problem.
  virtual Image<T> read(int frame) const = 0;
  /// Returns true if the files for read(frame) exist.
  virtual bool has(int /*frame*/) const { return true; }
  /// Throws Error if a file needed by a run does not exist.
  virtual void check_file(int /*frame*/) const {}
  /// Returns the choice of a depth source without its path ("cm", "sgbm").
  virtual std::string kind() const { return ""; }
  /// Returns a text such as "flow: dis", for provenance.
  virtual std::string provenance() const = 0;
};

using FlowSource = ChannelSource<Flow>;
using DepthSource = ChannelSource<float>;
using MaskSource = ChannelSource<uint16_t>;

/// Throws Error unless an image from `path` has the size of the sequence.
void check_size(int width, int height, const std::string& path, const ChannelInputs& inputs);

/// Make the source of a channel. Throw Error on an unknown choice (with the known ones), a folder that does
/// not exist, or a computation without its images. `inputs` is copied; the functions in it must outlive the
/// source.
std::unique_ptr<FlowSource> make_flow_source(const std::string& choice, const ChannelInputs& inputs);
std::unique_ptr<DepthSource> make_depth_source(const std::string& choice, const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_mask_source(const std::string& choice, const ChannelInputs& inputs,
                                             std::map<int, std::vector<LabelBox>> boxes = {});

}  // namespace sextant
