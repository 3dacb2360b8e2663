#include "sextant/datasets/kitti_tracking.h"

#include <algorithm>
#include <cmath>

#include "sextant/datasets/channels/channel_source.h"
#include "sextant/datasets/channels/frame_files.h"
#include "sextant/datasets/codec/mots.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/frame_range.h"
#include "sextant/datasets/object_truths.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

class KittiTracking final : public Sequence {
 public:
  KittiTracking(const SourceSpec& source, const KittiTrackingOptions& options)
      : training_(fs::path(source.path) / "training"), sequence_(source.sequence) {
    KittiTruth truth = read_kitti_truth(source.path, sequence_, options, inputs());
    truth_ = std::move(truth.truth);
    info_.dataset = source.adapter;
    info_.sequence = sequence_;
    info_.camera = truth.camera;
    info_.rate_hz = options.rate_hz;
    info_.warnings = std::move(truth.warnings);
    info_.provenance = std::move(truth.provenance);
    find_images();
    choose_frames(source, truth);
    find_size(source.path);
    open_channels(options);
  }

  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }

  Frame read(int frame, Channels channels) const override {
    check_frame(info_, frame, name());
    Frame out;
    out.index = frame;
    if (channels.gray || channels.rgb) read_left(frame, channels, out);
    if (channels.rgb_right && right_) out.rgb_right = read_image(*right_, frame, "right image");
    if (channels.depth && depth_) out.depth_m = depth_->read(frame);
    if (channels.flow && flow_) out.flow = flow_->read(frame);
    if (channels.mask && masks_) out.mask = masks_->read(frame);
    return out;
  }

  void check_files() const override {
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      if (left_) left_->at(frame, "image");
      if (right_ && depth_from_images_) right_->at(frame, "right image");
      if (depth_) depth_->check_file(frame);
      if (flow_ && frame != info_.last_frame) flow_->check_file(frame);
      if (masks_) masks_->check_file(frame);
    }
  }

 private:
  fs::path folder(const char* channel) const { return training_ / channel / sequence_; }
  std::string name() const { return fmt::format("{}: sequence {}", training_.string(), sequence_); }

  void find_images() {
    if (fs::is_directory(folder("image_02"))) left_.emplace(folder("image_02"), ".png");
    if (fs::is_directory(folder("image_03"))) right_.emplace(folder("image_03"), ".png");
    info_.channels.gray = info_.channels.rgb = left_.has_value();
    info_.channels.rgb_right = right_.has_value();
    if (!left_) info_.warnings.push_back(fmt::format("no {}: no images", folder("image_02").string()));
  }

  void choose_frames(const SourceSpec& source, const KittiTruth& truth) {
    std::set<int> frames;
    if (left_) {
      frames = left_->frames();
    } else {
      const int n = truth.n_poses > 0 ? truth.n_poses : truth.last_labelled_frame.value_or(-1) + 1;
      for (int frame = 0; frame < n; ++frame) frames.insert(frames.end(), frame);
    }
    sextant::choose_frames(source, frames, left_ ? folder("image_02").string() : name(), info_);
    if (truth.n_poses == 0 || info_.last_frame < truth.n_poses) return;
    const fs::path oxts = training_ / "oxts" / (sequence_ + ".txt");
    if (info_.first_frame >= truth.n_poses) {
      fail(
          "{}: it has frames 0-{}, but frames {}-{} are asked for: complete it, or remove it to run without "
          "true camera motion",
          oxts.string(), truth.n_poses - 1, info_.first_frame, info_.last_frame);
    }
    fail("{}: it has frames 0-{}, but frames {}-{} are asked for: complete it, or choose @{}-{}",
         oxts.string(), truth.n_poses - 1, info_.first_frame, info_.last_frame, info_.first_frame,
         truth.n_poses - 1);
  }

  void find_size(const fs::path& root) {
    if (left_) {
      const fs::path& first = left_->at(info_.first_frame, "image");
      const PngHeader header = png_header(inputs().read(first), first.string());
      info_.width = header.width;
      info_.height = header.height;
      return;
    }
    const KittiImageSize size = kitti_image_size(root, sequence_, inputs());
    info_.width = size.width;
    info_.height = size.height;
    if (size.is_known) return;
    info_.warnings.push_back(fmt::format("{}: no file tells the size of the images: using {}x{}", name(),
                                         size.width, size.height));
  }

  void open_channels(const KittiTrackingOptions& options) {
    const std::string depth = choose_depth(options.depth);
    const std::string flow = choose_flow(options.flow);
    const std::string masks = choose_masks(options.masks);
    const ChannelInputs from = channel_inputs();
    if (depth != "none") depth_ = make_depth_source(depth, from);
    if (flow != "none") flow_ = make_flow_source(flow, from);
    if (masks != "none") masks_ = make_mask_source(masks, from, label_boxes(truth_.objects));
    depth_from_images_ = depth == "sgbm";
    info_.channels.depth = depth_ != nullptr;
    if (depth_) info_.depth_kind = depth_->kind();
    info_.channels.flow = flow_ != nullptr;
    info_.channels.mask = masks_ != nullptr;
    info_.provenance.push_back(depth_ ? depth_->provenance() : "depth: none");
    info_.provenance.push_back(flow_ ? flow_->provenance() : "flow: none");
    info_.provenance.push_back(masks_ ? masks_->provenance() : "masks: none");
  }

  std::string choose_depth(const std::string& option) {
    if (option == "sgbm" && !right_) {
      fail(
          "{}: no such folder, and depth = sgbm needs its right images: add it, or give option depth "
          "(disparity256:DIR, depth256:DIR, cm:DIR or none)",
          folder("image_03").string());
    }
    if (option != "auto") return option;
    const fs::path files = folder("depth_02");
    if (fs::is_directory(files)) return "depth256:" + files.string();
    if (left_ && right_) return "sgbm";
    info_.warnings.push_back(
        fmt::format("no {} and no {}: no depth", files.string(), folder("image_03").string()));
    return "none";
  }

  std::string choose_flow(const std::string& option) {
    if (option != "auto") return option;
    const fs::path files = folder("flow_02");
    if (fs::is_directory(files)) return "kitti_png:" + files.string();
    if (left_) return "dis";
    info_.warnings.push_back(fmt::format("no {} and no images: no flow", files.string()));
    return "none";
  }

  std::string choose_masks(const std::string& option) {
    if (option != "auto") return option;
    const fs::path images = folder("instances");
    const fs::path text = training_ / "instances_txt" / (sequence_ + ".txt");
    if (fs::is_directory(images)) return "mots_png:" + images.string();
    if (fs::is_regular_file(text)) return "mots_txt:" + text.string();
    info_.warnings.push_back(
        fmt::format("no {} and no {}: no masks (option masks = boxes takes the label boxes)", images.string(),
                    text.string()));
    return "none";
  }

  ChannelInputs channel_inputs() {
    ChannelInputs from;
    if (left_) from.left = [this](int frame) { return read_image(*left_, frame, "image"); };
    if (right_) from.right = [this](int frame) { return read_image(*right_, frame, "right image"); };
    from.inputs = &inputs();
    from.width = info_.width;
    from.height = info_.height;
    from.first_frame = info_.first_frame;
    from.last_frame = info_.last_frame;
    from.camera = info_.camera;
    return from;
  }

  void read_left(int frame, Channels channels, Frame& out) const {
    if (!left_) return;
    if (channels.rgb) {
      out.rgb = read_image(*left_, frame, "image");
      if (channels.gray) out.gray = rgb_to_gray(out.rgb);
      return;
    }
    const fs::path& path = left_->at(frame, "image");
    out.gray = decode_png_gray(inputs().read(path), path.string());
    check_size(out.gray, path);
  }

  Image<Rgb> read_image(const FrameFiles& files, int frame, const char* what) const {
    const fs::path& path = files.at(frame, what);
    Image<Rgb> image = decode_png_rgb(inputs().read(path), path.string());
    check_size(image, path);
    return image;
  }

  template <typename T>
  void check_size(const Image<T>& image, const fs::path& path) const {
    if (image.width() == info_.width && image.height() == info_.height) return;
    fail("{}: {}x{} pixels, but the first image has {}x{}: all images of a sequence need the same size",
         path.string(), image.width(), image.height(), info_.width, info_.height);
  }

  fs::path training_;
  std::string sequence_;
  SequenceInfo info_;
  SequenceTruth truth_;
  std::optional<FrameFiles> left_, right_;
  std::unique_ptr<DepthSource> depth_;
  std::unique_ptr<FlowSource> flow_;
  std::unique_ptr<MaskSource> masks_;
  bool depth_from_images_ = false;
};

}  // namespace

void KittiTrackingOptions::check() const {
  KittiTruthOptions::check();
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "> 0");
}

std::unique_ptr<Sequence> open_kitti_tracking(const SourceSpec& source) {
  KittiTrackingOptions options;
  read_options(source.options, options, source.adapter);
  return std::make_unique<KittiTracking>(source, options);
}

}  // namespace sextant
