#pragma once

// Channels with a file a frame: the choices "kind:DIR" of channel_source.h, and what is of one data set alone.

#include "sextant/datasets/channels/channel_source.h"
#include "sextant/datasets/channels/frame_files.h"

namespace sextant {

template <typename T>
class FolderSource final : public ChannelSource<T> {
 public:
  using Decode = std::function<Image<T>(const std::string& bytes, const std::string& path)>;

  /// `channel` "flow", `kind` "flo"; `path` as in frame_files.h. Throws Error when there is no such folder, or no file
  /// with the extension in it.
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
