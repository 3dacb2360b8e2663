#include "sextant/datasets/folder_sequence.h"

#include <algorithm>

#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/dataset.h"

namespace sextant {

void mark_interpolated(ObjectTruths& objects) {
  for (auto& [frame, list] : objects) {
    for (ObjectTruth& object : list) {
      const ObjectTruth* before = find_object(objects, frame - 1, object.id);
      const ObjectTruth* after = find_object(objects, frame + 1, object.id);
      if (before == nullptr || after == nullptr) continue;
      const Eigen::Vector3d& p = object.T_camera_object.translation();
      const Eigen::Vector3d step_in = p - before->T_camera_object.translation();
      const Eigen::Vector3d step_out = after->T_camera_object.translation() - p;
      object.interpolated = (step_out - step_in).norm() <= 1e-6 * std::max(1.0, p.norm());
    }
  }
}

std::map<int, std::vector<LabelBox>> label_boxes(const ObjectTruths& objects) {
  std::map<int, std::vector<LabelBox>> boxes;
  for (const auto& [frame, row] : objects) {
    for (const ObjectTruth& object : row) {
      if (object.box)
        boxes[frame].push_back({object.id, *object.box, object.T_camera_object.translation().z()});
    }
  }
  return boxes;
}

namespace {

constexpr const char* image_extensions = ".png|.jpg";

Image<Rgb> decode_rgb(const std::string& bytes, const fs::path& path) {
  return path.extension() == ".png" ? decode_png_rgb(bytes, path.string())
                                    : decode_jpeg_rgb(bytes, path.string());
}

Image<uint8_t> decode_gray(const std::string& bytes, const fs::path& path) {
  return path.extension() == ".png" ? decode_png_gray(bytes, path.string())
                                    : rgb_to_gray(decode_rgb(bytes, path));
}

}  // namespace

std::string if_there(const fs::path& folder) { return fs::is_directory(folder) ? folder.string() : ""; }

void FolderSequence::choose_frames(const FolderFiles& files, const std::string& where) {
  where_ = where;
  if (!files.left.empty()) left_.emplace(files.left, image_extensions);
  if (!files.right.empty()) right_.emplace(files.right, image_extensions);
  for (const std::string& folder : {files.left, files.depth.files, files.masks.files, files.flow.files}) {
    if (folder.empty() || fs::is_regular_file(folder)) continue;
    const FrameFiles listed(folder, image_extensions);
    sextant::choose_frames(source_, listed.frames(), folder, info_);
    const fs::path& first = listed.at(info_.first_frame, "image");
    const std::string bytes = inputs().read(first);
    if (first.extension() == ".png") {
      const PngHeader header = png_header(bytes, first.string());
      info_.width = header.width;
      info_.height = header.height;
    } else {
      const Image<Rgb> image = decode_rgb(bytes, first);
      info_.width = image.width();
      info_.height = image.height();
    }
    channel_inputs_.size_from = first.string();
    return;
  }
  sextant::choose_frames(source_, files.frames, where, info_);
  info_.width = files.width;
  info_.height = files.height;
}

std::set<int> FolderSequence::image_frames() const { return left_ ? left_->frames() : std::set<int>(); }

template <typename T, typename Make>
FolderSequence::Opened<T> FolderSequence::open(const char* name, const FolderChannel<T>& channel,
                                               const Make& make) {
  Opened<T> opened;
  const bool is_auto = channel.option == "auto";
  const bool has_files = !channel.files.empty();
  std::string choice = channel.option;
  if (is_auto) choice = has_files || !left_ || channel.computed.empty() ? "none" : channel.computed;
  if (has_files && (is_auto || channel.exact)) {
    std::shared_ptr<ChannelSource<T>> own =
        channel.open ? channel.open(channel_inputs_)
                     : make(fmt::format("{}:{}", channel.kind, channel.files), channel_inputs_);
    if (is_auto) opened.source = own;
    if (channel.exact) opened.exact = own;
  }
  if (choice != "none") opened.source = make(choice, channel_inputs_);
  if (is_auto && !opened.source && !channel.if_none.empty()) info_.missing.push_back(channel.if_none);
  const bool is_own = is_auto && has_files && !channel.provenance.empty();
  info_.provenance.push_back(is_own          ? channel.provenance
                             : opened.source ? opened.source->provenance()
                                             : fmt::format("{}: none", name));
  return opened;
}

void FolderSequence::open_channels(const FolderFiles& files) {
  if (left_) channel_inputs_.left = [this](int frame) { return read_rgb(*left_, frame, "image"); };
  if (right_) channel_inputs_.right = [this](int frame) { return read_rgb(*right_, frame, "right image"); };
  channel_inputs_.inputs = &inputs();
  channel_inputs_.width = info_.width;
  channel_inputs_.height = info_.height;
  channel_inputs_.last_frame = info_.last_frame;
  channel_inputs_.camera = info_.camera;
  FolderChannel<float> depth = files.depth;
  if (!right_ && depth.computed == "sgbm") depth.computed.clear();
  depth_ = open("depth", depth, make_depth_source);
  flow_ = open("flow", files.flow, make_flow_source);
  masks_ = open("masks", files.masks, [&](const std::string& choice, const ChannelInputs& inputs) {
    return make_mask_source(choice, inputs, label_boxes(truth_.objects));
  });
  if (!files.backward_flow.files.empty()) {
    // Backward flow is missing in the first frame, as flow is in the last.
    channel_inputs_.last_frame = info_.first_frame;
    backward_flow_ = open("backward flow", files.backward_flow, make_flow_source);
    channel_inputs_.last_frame = info_.last_frame;
    info_.provenance.back().insert(0, "backward ");
  }
  info_.channels = {.gray = left_.has_value(),
                    .rgb = left_.has_value(),
                    .rgb_right = right_.has_value(),
                    .depth = depth_.source != nullptr,
                    .flow = flow_.source != nullptr,
                    .backward_flow = backward_flow_.source != nullptr,
                    .mask = masks_.source != nullptr};
  info_.exact = {.depth = depth_.is_exact(), .flow = flow_.is_exact()};
  if (depth_.source) info_.depth_kind = depth_.source->kind();
}

template <typename T, typename Decode>
Image<T> FolderSequence::read_image(const fs::path& path, const Decode& decode) const {
  Image<T> image = decode(inputs().read(path), path);
  check_size(image.width(), image.height(), path.string(), channel_inputs_);
  return image;
}

Image<Rgb> FolderSequence::read_rgb(const FrameFiles& files, int frame, const char* what) const {
  return read_image<Rgb>(files.at(frame, what), decode_rgb);
}

Frame FolderSequence::read(int frame, Channels channels) const {
  check_frame(info_, frame, where_);
  Frame out;
  out.index = frame;
  if (left_ && channels.rgb) {
    out.rgb = read_rgb(*left_, frame, "image");
    if (channels.gray) out.gray = rgb_to_gray(out.rgb);
  } else if (left_ && channels.gray) {
    out.gray = read_image<uint8_t>(left_->at(frame, "image"), decode_gray);
  }
  const auto read_channel = [&](bool wanted, const auto& channel, auto& image) {
    if (wanted && channel.source) image = channel.source->read(frame);
  };
  if (right_ && channels.rgb_right) out.rgb_right = read_rgb(*right_, frame, "right image");
  read_channel(channels.depth, depth_, out.depth_m);
  read_channel(channels.flow, flow_, out.flow);
  read_channel(channels.backward_flow, backward_flow_, out.backward_flow);
  read_channel(channels.mask, masks_, out.mask);
  return out;
}

std::optional<Image<Flow>> FolderSequence::true_flow(int frame) const {
  check_frame(info_, frame, where_);
  if (!flow_.exact || !flow_.exact->has(frame)) return std::nullopt;
  return flow_.exact->read(frame);
}

std::optional<Image<float>> FolderSequence::true_depth(int frame) const {
  check_frame(info_, frame, where_);
  if (!depth_.exact || !depth_.exact->has(frame)) return std::nullopt;
  return depth_.exact->read(frame);
}

void FolderSequence::check_files() const {
  for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
    if (left_) left_->at(frame, "image");
    if (right_) right_->at(frame, "right image");
    if (depth_.source) depth_.source->check_file(frame);
    if (masks_.source) masks_.source->check_file(frame);
    if (flow_.source) flow_.source->check_file(frame);
    if (backward_flow_.source) backward_flow_.source->check_file(frame);
  }
}

}  // namespace sextant
