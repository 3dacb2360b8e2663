#pragma once

// Files of a folder by frame number. FILES is one of
//
//   DIR           the frame's number is the first run of digits in a name ("000012.png", "flow_00012.png",
//                 "000012_10.png")
//   DIR/PREFIX*   only names that begin with PREFIX, and the number follows the prefix: with
//                 image_2/000007_*, 000007_10.png is frame 10

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "sextant/datasets/channels/channel_source.h"

namespace sextant {

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

// Channels with one file per frame: the choices "kind:DIR" of channel_source.h, and the formats that only one
// data set has.

template <typename T>
class FolderSource final : public ChannelSource<T> {
 public:
  using Decode = std::function<Image<T>(const std::string& bytes, const std::string& path)>;

  /// Opens the files of a channel ("flow") of a kind ("flo"); `path` is FILES as above. Throws Error if the
  /// folder does not exist, or contains no file with the extension.
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
