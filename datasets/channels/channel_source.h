#pragma once

// One channel of a sequence (flow, depth or masks), read from files of a known format or computed from the
// images. Adapters offer the choice as an option with the values in the first column:
//
//   flow    dis                 OpenCV's DIS, medium preset, from the image to the next
//           flo:DIR             Middlebury .flo
//           kitti_png:DIR       16-bit PNG, (n - 2^15) / 64 px
//           vkitti_png:DIR      16-bit PNG, (2 n / 65535 - 1)(size - 1) px
//           tartanair_png:DIR   16-bit PNG of TartanAir V2 (codec/dense_maps.h)
//           onnx:FILE           a network (network.h)
//   depth   sgbm                OpenCV's semi-global block matching with left-right check
//           disparity256:DIR    16-bit PNG, z = bf / (n / 256)
//           depth256:DIR        16-bit PNG, z = n / 256 m, 0 = invalid (KITTI depth benchmark)
//           cm:DIR              16-bit PNG, z = n / 100 m, 65535 = invalid
//           tartanair_png:DIR   PNG of TartanAir V2, a float32 in four channels (codec/dense_maps.h)
//   masks   instance_png:DIR    8- or 16-bit gray or palette PNG, the stored number is the id
//           mots_png:DIR        16-bit PNG, class * 1000 + track id; class 10 is ignored; id = track id + 1
//           mots_txt:FILE       "frame id class height width rle" (COCO run lengths); id = track id + 1
//           detections_txt:FILE the same form with any ids 1..65535, unchanged; earlier lines in front
//           vdo_text:DIR        integers as text
//           boxes               the 2-D label boxes, nearer objects in front; the least accurate choice
//           onnx:FILE           a network (network.h)
//
// A file in DIR belongs to the frame whose number is the first run of digits in its name; DIR/PREFIX* selects
// names that begin with PREFIX, and the number follows the prefix (see FrameFiles below).

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
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
  int last_frame = 0;                    ///< the frame whose flow may be missing
  StereoCamera camera;
};

/// A 2-D label box of one frame, px.
struct LabelBox {
  int id = 0;  ///< as in masks
  ImageBox box;
  double depth_m = 0;  ///< where boxes overlap, the nearer one is in front
};

template <typename T>
class ChannelSource {
 public:
  virtual ~ChannelSource() = default;
  /// Reads or computes the channel of a frame; the flow of the last frame may be empty. Safe to call from
  /// several threads. Throws Error that names the file, if there is one, and the problem.
  virtual Image<T> read(int frame) const = 0;
  /// Returns true if the files for read(frame) exist.
  virtual bool has(int /*frame*/) const { return true; }
  /// Throws Error if the file that a run needs for this frame does not exist.
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
/// not exist or has no such files, or a computation without its images. `inputs` is copied; everything that
/// its functions and pointers refer to must outlive the source.
std::unique_ptr<FlowSource> make_flow_source(const std::string& choice, const ChannelInputs& inputs);
std::unique_ptr<DepthSource> make_depth_source(const std::string& choice, const ChannelInputs& inputs);
std::unique_ptr<MaskSource> make_mask_source(const std::string& choice, const ChannelInputs& inputs,
                                             std::map<int, std::vector<LabelBox>> boxes = {});

/// Return the help of the options flow, depth and masks of adapters: the meaning of auto, and all choices.
const char* flow_option_help();
const char* depth_option_help();
const char* mask_option_help();

// ---- Files of a folder by frame number. FILES is one of
//
//   DIR           the frame's number is the first run of digits in a name ("000012.png", "flow_00012.png",
//                 "000012_10.png")
//   DIR/PREFIX*   only names that begin with PREFIX, and the number follows the prefix: with
//                 image_2/000007_*, 000007_10.png is frame 10

class FrameFiles {
 public:
  /// Lists FILES with this extension (".png"; several: ".jpg|.png"). Throws Error if the folder does not
  /// exist, contains no such file, or contains two files of one frame.
  FrameFiles(const std::string& files, const std::string& extensions);

  bool has(int frame) const { return paths_.contains(frame); }
  /// Returns the file of a frame. Throws Error that names the file, the frame and `what` if it does not
  /// exist.
  const std::filesystem::path& at(int frame, const std::string& what) const;
  std::set<int> frames() const;

 private:
  std::map<int, std::filesystem::path> paths_;
  std::string prefix_;  // of names, before the number
};

/// Returns true if there are files of any frame.
bool has_frame_files(const std::string& files, const std::string& extensions);

/// Throws the Error of FrameFiles::at().
[[noreturn]] void fail_missing(const std::filesystem::path& path, int frame, const std::string& what);

// Channels with one file per frame: the choices "kind:DIR" above, and the formats that only one
// data set has.

template <typename T>
class FolderSource final : public ChannelSource<T> {
 public:
  using Decode = std::function<Image<T>(const std::string& bytes, const std::string& path)>;

  /// Opens the files of a channel ("flow") of a kind ("flo"); `path` is FILES as above. Throws the errors of
  /// FrameFiles.
  FolderSource(std::string channel, std::string kind, const char* extension, const std::string& path,
               const ChannelInputs& inputs, Decode decode)
      : channel_(std::move(channel)),
        kind_(std::move(kind)),
        path_(path),
        files_(path, extension),
        inputs_(inputs),
        decode_(std::move(decode)) {}

  Image<T> read(int frame) const override {
    if (may_be_missing(frame)) return {};
    const std::filesystem::path& path = files_.at(frame, channel_);
    Image<T> image = decode_(inputs_.inputs->read(path), path.string());
    check_size(image.width(), image.height(), path.string(), inputs_);
    return image;
  }
  bool has(int frame) const override { return files_.has(frame); }
  void check_file(int frame) const override {
    if (!may_be_missing(frame)) files_.at(frame, channel_);
  }
  std::string kind() const override { return kind_; }
  std::string provenance() const override { return fmt::format("{}: {}:{}", channel_, kind_, path_); }

 private:
  bool may_be_missing(int frame) const {
    return std::is_same_v<T, Flow> && frame == inputs_.last_frame && !files_.has(frame);
  }

  std::string channel_, kind_, path_;
  FrameFiles files_;
  ChannelInputs inputs_;
  Decode decode_;
};

}  // namespace sextant
