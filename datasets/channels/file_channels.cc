#include "sextant/datasets/channels/file_channels.h"

#include "sextant/datasets/channels/frame_files.h"
#include "sextant/datasets/codec/flo.h"
#include "sextant/datasets/codec/kitti_png.h"
#include "sextant/datasets/codec/mask_text.h"
#include "sextant/datasets/codec/mots.h"

namespace sextant {
namespace {

struct Kind {
  std::string channel;    // "flow"
  std::string name;       // "flo"
  std::string extension;  // ".flo"
};

std::string provenance_of(const Kind& kind, const std::string& path) {
  return fmt::format("{}: {}:{}", kind.channel, kind.name, path);
}

// One file per frame.
template <typename T>
class FolderSource final : public ChannelSource<T> {
 public:
  using Decode = std::function<Image<T>(const std::string& bytes, const std::string& name)>;

  FolderSource(Kind kind, const std::string& path, const ChannelInputs& inputs, Decode decode)
      : kind_(std::move(kind)),
        files_(path, kind_.extension),
        inputs_(inputs),
        decode_(std::move(decode)),
        provenance_(provenance_of(kind_, path)) {}

  Image<T> read(int frame) const override {
    if (may_be_missing(frame)) return {};
    const std::filesystem::path& path = files_.at(frame, kind_.channel);
    Image<T> image = decode_(inputs_.inputs->read(path), path.string());
    check_size(image.width(), image.height(), path.string(), inputs_);
    return image;
  }
  bool has(int frame) const override { return files_.has(frame); }
  void check_file(int frame) const override {
    if (!may_be_missing(frame)) files_.at(frame, kind_.channel);
  }
  std::string kind() const override { return kind_.name; }
  std::string provenance() const override { return provenance_; }

 private:
  bool may_be_missing(int frame) const {
    return std::is_same_v<T, Flow> && frame == inputs_.last_frame && !files_.has(frame);
  }

  Kind kind_;
  FrameFiles files_;
  ChannelInputs inputs_;
  Decode decode_;
  std::string provenance_;
};

template <typename T>
std::unique_ptr<ChannelSource<T>> folder(Kind kind, const std::string& path, const ChannelInputs& inputs,
                                         typename FolderSource<T>::Decode decode) {
  return std::make_unique<FolderSource<T>>(std::move(kind), path, inputs, std::move(decode));
}

// One text file for all frames.
class MotsSource final : public MaskSource {
 public:
  MotsSource(const Kind& kind, const std::string& path, const ChannelInputs& inputs, MotsIds ids)
      : text_(inputs.inputs->read(path), path, ids),
        width_(inputs.width),
        height_(inputs.height),
        provenance_(provenance_of(kind, path)) {
    if (ids == MotsIds::detections) provenance_ += " (detections: ids are of one frame each, not tracks)";
  }

  Image<uint16_t> read(int frame) const override { return text_.mask(frame, width_, height_); }
  std::string provenance() const override { return provenance_; }

 private:
  MotsText text_;
  int width_;
  int height_;
  std::string provenance_;
};

Image<uint16_t> decode_instances(const std::string& bytes, const std::string& name) {
  if (png_header(bytes, name).bit_depth == 16) return decode_png16(bytes, name);
  const Image<uint8_t> ids = decode_png_index(bytes, name);
  Image<uint16_t> mask(ids.width(), ids.height());
  std::copy(ids.data(), ids.data() + ids.size(), mask.data());
  return mask;
}

}  // namespace

std::unique_ptr<FlowSource> make_flo_source(const std::string& path, const ChannelInputs& inputs) {
  return folder<Flow>({"flow", "flo", ".flo"}, path, inputs, decode_flo);
}

std::unique_ptr<FlowSource> make_kitti_flow_source(const std::string& path, const ChannelInputs& inputs) {
  return folder<Flow>({"flow", "kitti_png", ".png"}, path, inputs, [](const auto& bytes, const auto& name) {
    return flow_from_kitti(decode_png_rgb16(bytes, name));
  });
}

std::unique_ptr<FlowSource> make_vkitti_flow_source(const std::string& path, const ChannelInputs& inputs) {
  return folder<Flow>({"flow", "vkitti_png", ".png"}, path, inputs, [](const auto& bytes, const auto& name) {
    return flow_from_vkitti(decode_png_rgb16(bytes, name));
  });
}

std::unique_ptr<DepthSource> make_disparity256_source(const std::string& path, const ChannelInputs& inputs) {
  const double bf = inputs.camera.bf;
  return folder<float>({"depth", "disparity256", ".png"}, path, inputs,
                       [bf](const auto& bytes, const auto& name) {
                         return depth_from_disparity256(decode_png16(bytes, name), bf);
                       });
}

std::unique_ptr<DepthSource> make_depth256_source(const std::string& path, const ChannelInputs& inputs) {
  return folder<float>({"depth", "depth256", ".png"}, path, inputs, [](const auto& bytes, const auto& name) {
    return depth_from_depth256(decode_png16(bytes, name));
  });
}

std::unique_ptr<DepthSource> make_cm_source(const std::string& path, const ChannelInputs& inputs) {
  return folder<float>({"depth", "cm", ".png"}, path, inputs, [](const auto& bytes, const auto& name) {
    return depth_from_cm(decode_png16(bytes, name));
  });
}

std::unique_ptr<MaskSource> make_instance_png_source(const std::string& path, const ChannelInputs& inputs) {
  return folder<uint16_t>({"masks", "instance_png", ".png"}, path, inputs, decode_instances);
}

std::unique_ptr<MaskSource> make_mots_png_source(const std::string& path, const ChannelInputs& inputs) {
  return folder<uint16_t>(
      {"masks", "mots_png", ".png"}, path, inputs,
      [](const auto& bytes, const auto& name) { return mask_from_mots(decode_png16(bytes, name), name); });
}

std::unique_ptr<MaskSource> make_mots_txt_source(const std::string& path, const ChannelInputs& inputs) {
  return std::make_unique<MotsSource>(Kind{"masks", "mots_txt", ""}, path, inputs, MotsIds::tracks);
}

std::unique_ptr<MaskSource> make_detections_txt_source(const std::string& path, const ChannelInputs& inputs) {
  return std::make_unique<MotsSource>(Kind{"masks", "detections_txt", ""}, path, inputs, MotsIds::detections);
}

std::unique_ptr<MaskSource> make_vdo_text_source(const std::string& path, const ChannelInputs& inputs) {
  return folder<uint16_t>({"masks", "vdo_text", ".txt"}, path, inputs, decode_mask_text);
}

std::unique_ptr<MaskSource> make_mask_folder(
    const std::string& name, const std::string& files, const ChannelInputs& inputs,
    const std::function<Image<uint16_t>(const std::string& bytes, const std::string& path)>& decode) {
  return folder<uint16_t>({"masks", name, ".png"}, files, inputs, decode);
}

}  // namespace sextant
