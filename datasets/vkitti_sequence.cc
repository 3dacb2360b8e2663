#include "sextant/datasets/vkitti_sequence.h"

#include <cmath>

#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/frame_range.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

constexpr const char* kImages = ".png|.jpg";

// Backward flow is missing in the first frame, as flow is in the last.
ChannelInputs turned_round(ChannelInputs inputs) {
  inputs.last_frame = inputs.first_frame;
  return inputs;
}

PngHeader size_of(const fs::path& path, InputLog& inputs) {
  const std::string bytes = inputs.read(path);
  if (path.extension() == ".png") return png_header(bytes, path.string());
  const Image<Rgb> image = decode_jpeg_rgb(bytes, path.string());
  PngHeader header;
  header.width = image.width();
  header.height = image.height();
  return header;
}

}  // namespace

std::optional<fs::path> existing_folder(const fs::path& folder) {
  if (fs::is_directory(folder)) return folder;
  return std::nullopt;
}

void check_vkitti_options(double rate_hz, const VkittiChannelChoice& choice) {
  check_option(std::isfinite(rate_hz) && rate_hz > 0, "rate_hz", rate_hz, "> 0");
  check_option(!choice.flow.empty(), "flow", choice.flow, "auto or a kind of flow");
  check_option(!choice.depth.empty(), "depth", choice.depth, "auto or a kind of depth");
  check_option(!choice.masks.empty(), "masks", choice.masks, "auto or a kind of masks");
}

void VkittiSequence::choose_frames(const SourceSpec& source, const VkittiFolders& folders,
                                   const std::string& where) {
  where_ = where;
  if (folders.left) left_.emplace(*folders.left, kImages);
  if (folders.right) right_.emplace(*folders.right, kImages);
  std::set<int> frames;
  std::string place = where;
  std::optional<fs::path> sized;
  for (const auto* folder : {&folders.left, &folders.depth, &folders.masks, &folders.flow}) {
    if (!*folder) continue;
    const FrameFiles files(**folder, kImages);
    frames = files.frames();
    place = (*folder)->string();
    sized = files.at(*frames.begin(), "size");
    break;
  }
  if (!sized) {
    for (const auto& [frame, pose] : truth_.camera.poses()) frames.insert(frame);
    if (frames.empty()) {
      for (const auto& [frame, objects] : truth_.objects) frames.insert(frame);
    }
  }
  sextant::choose_frames(source, frames, place, info_);
  info_.width = kWidth;
  info_.height = kHeight;
  if (sized) {
    const PngHeader header = size_of(*sized, inputs());
    info_.width = header.width;
    info_.height = header.height;
  }
  if (truth_.camera.empty()) return;
  for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
    if (truth_.camera.has(frame)) continue;
    fail(
        "{}: the extrinsics have no row of frame {}, of which there are files in {}: take both from the same "
        "sequence, or choose other frames with @first-last",
        where, frame, place);
  }
}

void VkittiSequence::open_channels(const VkittiFolders& folders, const VkittiChannelChoice& choice,
                                   const MakeMasks& own_masks) {
  channel_inputs_.inputs = &inputs();
  channel_inputs_.width = info_.width;
  channel_inputs_.height = info_.height;
  channel_inputs_.first_frame = info_.first_frame;
  channel_inputs_.last_frame = info_.last_frame;
  channel_inputs_.camera = info_.camera;
  if (left_) channel_inputs_.left = [this](int frame) { return read_image(left_->at(frame, "image")); };
  if (right_) {
    channel_inputs_.right = [this](int frame) { return read_image(right_->at(frame, "right image")); };
  }
  info_.channels.gray = info_.channels.rgb = left_.has_value();
  info_.channels.rgb_right = right_.has_value();
  open_flow(folders, choice.flow);
  open_depth(folders, choice.depth);
  open_masks(folders, choice.masks, own_masks);
}

void VkittiSequence::open_flow(const VkittiFolders& folders, const std::string& choice) {
  const auto own = [](const fs::path& folder) { return "vkitti_png:" + folder.string(); };
  if (folders.flow) own_flow_ = make_flow_source(own(*folders.flow), channel_inputs_);
  if (choice != "auto") {
    flow_ = make_flow_source(choice, channel_inputs_);
  } else if (folders.flow) {
    flow_ = make_flow_source(own(*folders.flow), channel_inputs_);
  } else if (left_) {
    flow_ = make_flow_source("dis", channel_inputs_);
  }
  if (folders.backward_flow) {
    backward_flow_ = make_flow_source(own(*folders.backward_flow), turned_round(channel_inputs_));
    info_.channels.backward_flow = true;
    info_.provenance.push_back("backward " + backward_flow_->provenance());
  }
  info_.channels.flow = flow_ != nullptr;
  info_.exact.flow = choice == "auto" && folders.flow;
  if (flow_) info_.provenance.push_back(flow_->provenance());
}

void VkittiSequence::open_depth(const VkittiFolders& folders, const std::string& choice) {
  std::unique_ptr<DepthSource> own;
  if (folders.depth) own = make_depth_source("cm:" + folders.depth->string(), channel_inputs_);
  if (choice != "auto") {
    depth_ = make_depth_source(choice, channel_inputs_);
    own_depth_ = std::move(own);
  } else if (own) {
    depth_ = std::move(own);
  } else if (left_ && right_) {
    depth_ = make_depth_source("sgbm", channel_inputs_);
  }
  info_.channels.depth = depth_ != nullptr;
  info_.exact.depth = choice == "auto" && folders.depth;
  if (depth_) info_.depth_kind = depth_->kind();
  if (depth_) info_.provenance.push_back(depth_->provenance());
}

void VkittiSequence::open_masks(const VkittiFolders& folders, const std::string& choice,
                                const MakeMasks& own_masks) {
  if (choice != "auto") {
    masks_ = make_mask_source(choice, channel_inputs_, label_boxes());
  } else if (folders.masks) {
    masks_ = own_masks(channel_inputs_);
  }
  info_.channels.mask = masks_ != nullptr;
  if (masks_) info_.provenance.push_back(masks_->provenance());
}

std::map<int, std::vector<LabelBox>> VkittiSequence::label_boxes() const {
  std::map<int, std::vector<LabelBox>> boxes;
  for (const auto& [frame, objects] : truth_.objects) {
    for (const ObjectTruth& o : objects) {
      if (!o.left) continue;
      boxes[frame].push_back(
          {o.id, *o.left, *o.top, *o.right, *o.bottom, o.T_camera_object.translation().z()});
    }
  }
  return boxes;
}

Image<Rgb> VkittiSequence::read_image(const fs::path& path) const {
  const std::string bytes = inputs().read(path);
  Image<Rgb> image = path.extension() == ".png" ? decode_png_rgb(bytes, path.string())
                                                : decode_jpeg_rgb(bytes, path.string());
  if (image.width() != info_.width || image.height() != info_.height) {
    fail("{}: {}x{} pixels, but the others have {}x{}: all files of a sequence need the same size",
         path.string(), image.width(), image.height(), info_.width, info_.height);
  }
  return image;
}

Frame VkittiSequence::read(int frame, Channels channels) const {
  check_frame(info_, frame, where_);
  Frame out;
  out.index = frame;
  if (left_ && (channels.gray || channels.rgb)) {
    out.rgb = channel_inputs_.left(frame);
    if (channels.gray) out.gray = rgb_to_gray(out.rgb);
    if (!channels.rgb) out.rgb = {};
  }
  if (right_ && channels.rgb_right) out.rgb_right = channel_inputs_.right(frame);
  if (depth_ && channels.depth) out.depth_m = depth_->read(frame);
  if (flow_ && channels.flow) out.flow = flow_->read(frame);
  if (backward_flow_ && channels.backward_flow) out.backward_flow = backward_flow_->read(frame);
  if (masks_ && channels.mask) out.mask = masks_->read(frame);
  return out;
}

std::optional<Image<Flow>> VkittiSequence::true_flow(int frame) const {
  check_frame(info_, frame, where_);
  if (!own_flow_) return std::nullopt;
  Image<Flow> flow = own_flow_->read(frame);
  if (flow.empty()) return std::nullopt;
  return flow;
}

std::optional<Image<float>> VkittiSequence::true_depth(int frame) const {
  check_frame(info_, frame, where_);
  if (!own_depth_) return std::nullopt;
  return own_depth_->read(frame);
}

void VkittiSequence::check_files() const {
  for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
    if (left_) left_->at(frame, "image");
    if (right_) right_->at(frame, "right image");
    if (depth_) depth_->check_file(frame);
    if (masks_) masks_->check_file(frame);
    if (flow_) flow_->check_file(frame);
    if (backward_flow_) backward_flow_->check_file(frame);
  }
}

}  // namespace sextant
