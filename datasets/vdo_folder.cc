#include "sextant/datasets/vdo_folder.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "sextant/datasets/channels/channel_source.h"
#include "sextant/datasets/codec/flo.h"
#include "sextant/datasets/codec/kitti_png.h"
#include "sextant/datasets/codec/mask_text.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/text_rows.h"
#include "sextant/datasets/codec/yaml_camera.h"
#include "sextant/datasets/frame_range.h"
#include "sextant/datasets/object_truths.h"
#include "sextant/datasets/vdo_truth.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

// KITTI tracking 0003, left colour camera. The authors' demo gives the bf of the grey pair although its
// images and depth are of the colour pair: depth is 0.8 % too large. bf_preset = colour mends that.
constexpr int kDemoWidth = 1242;
constexpr int kDemoHeight = 375;
constexpr double kAuthorsBf = 387.5744;
constexpr double kColourBf = 384.3814;
constexpr double kDefaultRateHz = 10;

const StereoCamera& demo_camera() {
  static const StereoCamera camera{{721.5377, 721.5377, 609.5593, 172.8540}, kAuthorsBf};
  return camera;
}

// The frame number of "000012.png"; empty for any other name.
std::optional<int> frame_of(const fs::path& file) {
  const std::string stem = file.stem().string();
  const bool digits = std::ranges::all_of(stem, [](char c) { return c >= '0' && c <= '9'; });
  if (file.extension() != ".png" || stem.size() != 6 || !digits) return std::nullopt;
  return std::stoi(stem);
}

class VdoFolder final : public Sequence {
 public:
  VdoFolder(const SourceSpec& source, const VdoFolderOptions& options) : dir_(source.path) {
    find_images();
    choose_frames(source);
    info_.dataset = "vdo";
    info_.sequence = source.sequence.empty()
                         ? fs::absolute(dir_ / "").lexically_normal().parent_path().filename().string()
                         : source.sequence;
    const fs::path first = image_path(info_.first_frame);
    const PngHeader header = png_header(inputs().read(first), first.string());
    info_.width = header.width;
    info_.height = header.height;
    info_.channels = {.gray = true, .rgb = true, .depth = true, .flow = true, .mask = true};
    choose_camera(options);
    read_times();
    read_truth();
    open_channels(options);
  }

  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }

  Frame read(int frame, Channels channels) const override {
    check_frame(info_, frame, dir_.string());
    Frame out;
    out.index = frame;
    if (channels.gray || channels.rgb) read_image(image_path(frame), channels, out);
    if (channels.depth && depth_) {
      out.depth_m = depth_->read(frame);
    } else if (channels.depth) {
      const fs::path path = depth_path(frame);
      out.depth_m =
          depth_from_disparity256(decode_png16(inputs().read(path), path.string()), info_.camera.bf);
      check_size(out.depth_m, path);
    }
    if (channels.flow && flow_) {
      out.flow = flow_->read(frame);
    } else if (channels.flow) {
      const fs::path path = flow_path(frame);
      if (frame != info_.last_frame || fs::exists(path)) {
        out.flow = decode_flo(inputs().read(path), path.string());
        check_size(out.flow, path);
      }
    }
    if (channels.mask && masks_) {
      out.mask = masks_->read(frame);
    } else if (channels.mask) {
      const fs::path path = mask_path(frame);
      out.mask = decode_mask_text(inputs().read(path), path.string());
      check_size(out.mask, path);
    }
    return out;
  }

  void check_files() const override {
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      need(image_path(frame), frame, "image");
      depth_ ? depth_->check_file(frame) : need(depth_path(frame), frame, "depth");
      masks_ ? masks_->check_file(frame) : need(mask_path(frame), frame, "mask");
      if (frame == info_.last_frame) continue;
      flow_ ? flow_->check_file(frame) : need(flow_path(frame), frame, "flow");
    }
  }

 private:
  fs::path image_path(int frame) const { return images_ / fmt::format("{:06}.png", frame); }
  fs::path depth_path(int frame) const { return dir_ / "depth" / fmt::format("{:06}.png", frame); }
  fs::path flow_path(int frame) const { return dir_ / "flow" / fmt::format("{:06}.flo", frame); }
  fs::path mask_path(int frame) const { return dir_ / "semantic" / fmt::format("{:06}.txt", frame); }

  void find_images() {
    if (!fs::is_directory(dir_)) fail("{}: no such folder", dir_.string());
    for (const char* name : {"image_0", "image"}) {
      images_ = dir_ / name;
      if (fs::is_directory(images_)) return;
    }
    fail(
        "{}: no folder image_0 or image in it: expected a VDO-SLAM folder with image_0, depth, flow and "
        "semantic",
        dir_.string());
  }

  void choose_frames(const SourceSpec& source) {
    std::set<int> frames;
    for (const auto& entry : fs::directory_iterator(images_)) {
      if (const auto frame = frame_of(entry.path())) frames.insert(*frame);
    }
    if (frames.empty()) fail("{}: no images named like 000000.png", images_.string());
    sextant::choose_frames(source, frames, images_.string(), info_);
  }

  void choose_camera(const VdoFolderOptions& options) {
    const bool complete =
        options.fx > 0 && options.fy > 0 && options.cx > 0 && options.cy > 0 && options.bf > 0;
    YamlCamera found;
    if (const auto yaml = find_yaml(complete)) {
      found = decode_yaml_camera(inputs().read(*yaml), yaml->string());
    } else if (!complete) {
      need_demo_size("no *.yaml camera in this folder: add one, or give the options fx, fy, cx, cy and bf");
      found.camera = demo_camera();
      info_.warnings.push_back(fmt::format(
          "no *.yaml camera in {}: using the KITTI 0003 demo's f = 721.5377, c = (609.5593, 172.8540), "
          "bf = 387.5744",
          dir_.string()));
    }
    if (options.bf_preset == VdoPair::colour) {
      need_demo_size("option bf_preset = colour is that of KITTI 0003: give the option bf instead");
      found.camera.bf = kColourBf;
    }
    const auto override_with = [](double option, double& value) { value = option > 0 ? option : value; };
    override_with(options.fx, found.camera.left.fx);
    override_with(options.fy, found.camera.left.fy);
    override_with(options.cx, found.camera.left.cx);
    override_with(options.cy, found.camera.left.cy);
    override_with(options.bf, found.camera.bf);
    info_.camera = found.camera;
    info_.camera.check();
    info_.rate_hz = options.rate_hz > 0 ? options.rate_hz
                    : found.rate_hz > 0 ? found.rate_hz
                                        : kDefaultRateHz;
    rate_is_assumed_ = !(options.rate_hz > 0) && !(found.rate_hz > 0);
  }

  // The folder's camera file. With a camera given in full by options, several are no ambiguity.
  std::optional<fs::path> find_yaml(bool complete) const {
    std::set<fs::path> files;
    for (const auto& entry : fs::directory_iterator(dir_)) {
      const fs::path& path = entry.path();
      if (path.extension() == ".yaml" || path.extension() == ".yml") files.insert(path);
    }
    if (files.empty()) return std::nullopt;
    if (files.size() > 1 && complete) return std::nullopt;
    if (files.size() > 1) {
      fail("{}: {} camera files (such as {} and {}): keep one, or give the options fx, fy, cx, cy and bf",
           dir_.string(), files.size(), files.begin()->filename().string(),
           files.rbegin()->filename().string());
    }
    return *files.begin();
  }

  void need_demo_size(const char* message) const {
    if (info_.width == kDemoWidth && info_.height == kDemoHeight) return;
    fail("{}: {} (KITTI 0003 has {}x{} pixels, these images {}x{})", dir_.string(), message, kDemoWidth,
         kDemoHeight, info_.width, info_.height);
  }

  // Line k is the time of frame k.
  void read_times() {
    const fs::path path = dir_ / "times.txt";
    if (!fs::exists(path)) {
      if (rate_is_assumed_) {
        info_.warnings.push_back(fmt::format(
            "no frame rate in a *.yaml and no {}: {} Hz are assumed, and velocities are proportional to it "
            "(change it with the option rate_hz)",
            path.string(), kDefaultRateHz));
      }
      return;
    }
    std::vector<double> times;
    const std::string text = inputs().read(path);
    for (TextRows rows(text, path.string()); rows.next();) times.push_back(rows.finite(0, "a time"));
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      if (static_cast<size_t>(frame) < times.size()) info_.times_s[frame] = times[static_cast<size_t>(frame)];
    }
    if (times.size() < 2) return;
    const double step_s = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
    if (std::abs(step_s * info_.rate_hz - 1) > 0.01) {
      info_.warnings.push_back(
          fmt::format("{}: steps of {:.4g} s, but the rate is {:.4g} Hz: using the rate "
                      "(change it with the option rate_hz)",
                      path.string(), step_s, info_.rate_hz));
    }
  }

  void read_truth() {
    const fs::path poses = dir_ / "pose_gt.txt";
    if (fs::exists(poses)) {
      for (const auto& [frame, pose] : decode_pose_text(inputs().read(poses), poses.string())) {
        truth_.camera.set(frame, pose);
      }
      warn_about_frames_without_pose(poses);
    } else {
      info_.warnings.push_back(fmt::format("no {}: no true camera motion", poses.string()));
    }
    const fs::path objects = dir_ / "object_pose.txt";
    if (fs::exists(objects)) {
      truth_.objects = decode_vdo_objects(inputs().read(objects), objects.string());
    } else {
      info_.warnings.push_back(fmt::format("no {}: no true object motion", objects.string()));
    }
  }

  void warn_about_frames_without_pose(const fs::path& poses) {
    std::vector<int> missing;
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      if (!truth_.camera.has(frame)) missing.push_back(frame);
    }
    if (missing.empty()) return;
    info_.warnings.push_back(fmt::format("{}: no pose for {} of {} frames, the first is {}", poses.string(),
                                         missing.size(), info_.last_frame - info_.first_frame + 1,
                                         missing.front()));
  }

  void open_channels(const VdoFolderOptions& options) {
    const ChannelInputs from{.left =
                                 [this](int frame) {
                                   Frame out;
                                   read_image(image_path(frame), {.rgb = true}, out);
                                   return out.rgb;
                                 },
                             .inputs = &inputs(),
                             .width = info_.width,
                             .height = info_.height,
                             .first_frame = info_.first_frame,
                             .last_frame = info_.last_frame,
                             .camera = info_.camera};
    if (options.depth != "auto") depth_ = make_depth_source(options.depth, from);
    if (options.flow != "auto") flow_ = make_flow_source(options.flow, from);
    if (options.masks != "auto") masks_ = make_mask_source(options.masks, from, label_boxes(truth_.objects));
    info_.depth_kind = depth_ ? depth_->kind() : "disparity256";
    info_.provenance = {
        depth_ ? depth_->provenance() : fmt::format("depth: disparity png, bf = {:.7g}", info_.camera.bf),
        flow_ ? flow_->provenance() : "flow: precomputed .flo",
        masks_ ? masks_->provenance() : "masks: precomputed text"};
  }

  void read_image(const fs::path& path, Channels channels, Frame& out) const {
    const std::string bytes = inputs().read(path);
    if (channels.rgb) {
      out.rgb = decode_png_rgb(bytes, path.string());
      check_size(out.rgb, path);
      if (channels.gray) out.gray = rgb_to_gray(out.rgb);
    } else {
      out.gray = decode_png_gray(bytes, path.string());
      check_size(out.gray, path);
    }
  }

  template <typename T>
  void check_size(const Image<T>& image, const fs::path& path) const {
    if (image.width() == info_.width && image.height() == info_.height) return;
    fail("{}: {}x{} pixels, but {} has {}x{}: all files of a sequence need the same size", path.string(),
         image.width(), image.height(), image_path(info_.first_frame).string(), info_.width, info_.height);
  }

  static void need(const fs::path& path, int frame, const char* what) {
    if (!fs::is_regular_file(path)) {
      fail("{}: missing file: frame {} needs its {}; add it, or choose other frames with @first-last",
           path.string(), frame, what);
    }
  }

  fs::path dir_;
  fs::path images_;
  SequenceInfo info_;
  bool rate_is_assumed_ = false;  // neither option nor camera file has one
  SequenceTruth truth_;
  std::unique_ptr<DepthSource> depth_;  // empty: the folder's own
  std::unique_ptr<FlowSource> flow_;
  std::unique_ptr<MaskSource> masks_;
};

}  // namespace

void VdoFolderOptions::check() const {
  const auto not_negative = [](const char* name, double value) {
    check_option(std::isfinite(value) && value >= 0, name, value, "0 (from the folder) or larger");
  };
  not_negative("rate_hz", rate_hz);
  not_negative("fx", fx);
  not_negative("fy", fy);
  not_negative("cx", cx);
  not_negative("cy", cy);
  not_negative("bf", bf);
}

std::unique_ptr<Sequence> open_vdo_folder(const SourceSpec& source) {
  VdoFolderOptions options;
  read_options(source.options, options, source.adapter);
  return std::make_unique<VdoFolder>(source, options);
}

}  // namespace sextant
