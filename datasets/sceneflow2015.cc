#include "sextant/datasets/sceneflow2015.h"

#include <cmath>
#include <filesystem>

#include "sextant/datasets/channels/channel_source.h"
#include "sextant/datasets/codec/kitti_png.h"
#include "sextant/datasets/codec/text_rows.h"
#include "sextant/datasets/frame_range.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

constexpr int kFirst = 10;
constexpr int kSecond = 11;
constexpr double kRateHz = 10;

using Matrix34d = Eigen::Matrix<double, 3, 4>;

// P_rect_02 and P_rect_03 of calib_cam_to_cam.
StereoCamera decode_camera(std::string_view text, const std::string& name) {
  std::map<std::string, Matrix34d> found;
  for (TextRows rows(text, name); rows.next();) {
    const std::string key(rows.field(0));
    if (key != "P_rect_02:" && key != "P_rect_03:") continue;
    rows.expect(13, key + " and 12 numbers (13 values)");
    Matrix34d p;
    for (int i = 0; i < 12; ++i) p(i / 4, i % 4) = rows.finite(static_cast<size_t>(i) + 1, key);
    if (!found.emplace(key, p).second) rows.fail_here("{} is there twice", key);
    if (!(p(0, 0) > 0) || !(p(1, 1) > 0)) rows.fail_here("{} focal lengths must be positive", key);
  }
  for (const char* key : {"P_rect_02:", "P_rect_03:"}) {
    if (!found.contains(key)) {
      fail("{}: no line '{}': expected a calib_cam_to_cam file of KITTI scene flow 2015", name, key);
    }
  }
  const Matrix34d& left = found.at("P_rect_02:");
  const StereoCamera camera{{left(0, 0), left(1, 1), left(0, 2), left(1, 2)},
                            left(0, 3) - found.at("P_rect_03:")(0, 3)};
  if (!(camera.bf > 0)) fail("{}: P_rect_02 and P_rect_03 give bf = {}, expected > 0", name, camera.bf);
  return camera;
}

class SceneFlow2015 final : public Sequence {
 public:
  SceneFlow2015(const SourceSpec& source, const SceneFlow2015Options& options) {
    find_root(source.path);
    find_pair(source.sequence);
    info_.dataset = "sceneflow";
    info_.sequence = pair_;
    info_.rate_hz = kRateHz;
    choose_frames(source, {kFirst, kSecond}, fmt::format("{}: pair {}", root_.string(), pair_), info_);
    const fs::path calibration = calibration_path();
    info_.camera = decode_camera(inputs().read(calibration), calibration.string());
    info_.camera.check();
    const PngHeader header =
        png_header(inputs().read(image_path("image_2", kFirst)), image_path("image_2", kFirst).string());
    info_.width = header.width;
    info_.height = header.height;
    info_.warnings.push_back(
        fmt::format("{}: the data set has no poses: nothing to measure motion with", root_.string()));
    open_channels(options);
  }

  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }

  Frame read(int frame, Channels channels) const override {
    check_frame(info_, frame, root_.string());
    Frame out;
    out.index = frame;
    if (channels.rgb || channels.gray) {
      out.rgb = read_image("image_2", frame);
      if (channels.gray) out.gray = rgb_to_gray(out.rgb);
      if (!channels.rgb) out.rgb = {};
    }
    if (channels.rgb_right) out.rgb_right = read_image("image_3", frame);
    if (channels.depth) {
      out.depth_m = depth_ ? depth_->read(frame) : true_depth_here(frame);
    }
    if (channels.flow && frame == kFirst) out.flow = flow_ ? flow_->read(frame) : true_flow_here();
    if (channels.mask && masks_) out.mask = masks_->read(frame);
    return out;
  }

  std::optional<Image<Flow>> true_flow(int frame) const override {
    if (frame != kFirst || !fs::exists(truth_path("flow_occ"))) return std::nullopt;
    return true_flow_here();
  }
  std::optional<Image<float>> true_depth(int frame) const override {
    for (const fs::path& path : depth_truth_paths(frame)) {
      if (!fs::exists(path)) return std::nullopt;
    }
    return true_depth_here(frame);
  }

  void check_files() const override {
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      need(image_path("image_2", frame), frame, "left image");
      if (right_needed_) need(image_path("image_3", frame), frame, "right image");
      if (depth_) {
        depth_->check_file(frame);
      } else {
        for (const fs::path& path : depth_truth_paths(frame)) need(path, frame, "true depth");
      }
      if (frame == kFirst && flow_) flow_->check_file(frame);
      if (frame == kFirst && !flow_) need(truth_path("flow_occ"), frame, "true flow");
      if (masks_) masks_->check_file(frame);
    }
  }

 private:
  fs::path image_path(const char* folder, int frame) const {
    return root_ / folder / fmt::format("{}_{}.png", pair_, frame);
  }
  fs::path truth_path(const char* folder) const { return image_path(folder, kFirst); }
  std::vector<fs::path> depth_truth_paths(int frame) const {
    if (frame == kFirst) return {truth_path("disp_occ_0")};
    return {truth_path("disp_occ_1"), truth_path("flow_occ")};
  }

  void find_root(const fs::path& path) {
    if (!fs::is_directory(path)) fail("{}: no such folder", path.string());
    for (const fs::path& root : {path, path / "training"}) {
      root_ = root;
      if (fs::is_directory(root_ / "image_2")) return;
    }
    fail("{}: no folder image_2 or training/image_2 in it: expected KITTI scene flow 2015", path.string());
  }

  void find_pair(const std::string& asked) {
    std::set<std::string> pairs;
    for (const auto& entry : fs::directory_iterator(root_ / "image_2")) {
      const std::string name = entry.path().filename().string();
      if (name.size() == 13 && name.ends_with("_10.png")) pairs.insert(name.substr(0, 6));
    }
    if (pairs.empty()) fail("{}: no images named like 000002_10.png", (root_ / "image_2").string());
    const std::string choices =
        fmt::format("{} pairs, {} to {}", pairs.size(), *pairs.begin(), *pairs.rbegin());
    if (asked.empty() && pairs.size() > 1) {
      fail("{}: say which pair with #: it has {}", root_.string(), choices);
    }
    pair_ = asked.empty() ? *pairs.begin() : asked;
    if (!pairs.contains(pair_)) fail("{}: no pair '{}': it has {}", root_.string(), pair_, choices);
  }

  fs::path calibration_path() const {
    for (const char* folder : {"calib_cam_to_cam", "calib_cam"}) {
      const fs::path path = root_ / folder / (pair_ + ".txt");
      if (fs::exists(path)) return path;
    }
    fail("{}: no such file (nor in calib_cam): it comes with the calibration files of the data set",
         (root_ / "calib_cam_to_cam" / (pair_ + ".txt")).string());
  }

  void open_channels(const SceneFlow2015Options& options) {
    ChannelInputs from{.left = [this](int frame) { return read_image("image_2", frame); },
                       .inputs = &inputs(),
                       .width = info_.width,
                       .height = info_.height,
                       .first_frame = info_.first_frame,
                       .last_frame = info_.last_frame,
                       .camera = info_.camera};
    const bool has_right = fs::is_directory(root_ / "image_3");
    if (has_right) from.right = [this](int frame) { return read_image("image_3", frame); };
    const std::string depth = options.depth == "auto" ? "sgbm" : options.depth;
    const std::string flow = options.flow == "auto" ? "dis" : options.flow;
    right_needed_ = depth == "sgbm";
    if (depth != "truth") depth_ = make_depth_source(depth, from);
    if (flow != "truth") flow_ = make_flow_source(flow, from);
    if (options.masks != "none") masks_ = make_mask_source(options.masks, from);
    info_.channels = {.gray = true,
                      .rgb = true,
                      .rgb_right = has_right,
                      .depth = true,
                      .flow = true,
                      .mask = masks_ != nullptr};
    info_.exact = {.depth = !depth_, .flow = !flow_};
    info_.depth_kind = depth_ ? depth_->kind() : "disparity256";
    info_.provenance = {depth_ ? depth_->provenance() : "depth: truth",
                        flow_ ? flow_->provenance() : "flow: truth",
                        masks_ ? masks_->provenance() : "masks: none"};
  }

  Image<Flow> true_flow_here() const {
    const fs::path path = truth_path("flow_occ");
    Image<Flow> flow = flow_from_kitti(decode_png_rgb16(inputs().read(path), path.string()));
    check_size(flow, path);
    return flow;
  }

  Image<float> true_depth_here(int frame) const {
    const fs::path path = depth_truth_paths(frame).front();
    Image<float> depth =
        depth_from_disparity256(decode_png16(inputs().read(path), path.string()), info_.camera.bf);
    check_size(depth, path);
    return frame == kFirst ? depth : carry_depth_along_flow(depth, true_flow_here());
  }

  Image<Rgb> read_image(const char* folder, int frame) const {
    const fs::path path = image_path(folder, frame);
    Image<Rgb> image = decode_png_rgb(inputs().read(path), path.string());
    check_size(image, path);
    return image;
  }

  template <typename T>
  void check_size(const Image<T>& image, const fs::path& path) const {
    if (image.width() == info_.width && image.height() == info_.height) return;
    fail("{}: {}x{} pixels, but {} has {}x{}: all files of a pair need the same size", path.string(),
         image.width(), image.height(), image_path("image_2", kFirst).string(), info_.width, info_.height);
  }

  static void need(const fs::path& path, int frame, const char* what) {
    if (!fs::is_regular_file(path)) {
      fail("{}: missing file: frame {} needs its {}; add it, or choose another pair", path.string(), frame,
           what);
    }
  }

  fs::path root_;
  std::string pair_;
  SequenceInfo info_;
  SequenceTruth truth_;                 // none
  std::unique_ptr<DepthSource> depth_;  // empty: the truth
  std::unique_ptr<FlowSource> flow_;    // empty: the truth
  std::unique_ptr<MaskSource> masks_;   // empty: none
  bool right_needed_ = false;
};

}  // namespace

Image<float> carry_depth_along_flow(const Image<float>& next_depth_m, const Image<Flow>& flow) {
  SEXTANT_CHECK(next_depth_m.width() == flow.width() && next_depth_m.height() == flow.height());
  Image<float> depth(flow.width(), flow.height(), NAN);
  for (int y = 0; y < flow.height(); ++y) {
    for (int x = 0; x < flow.width(); ++x) {
      const Flow f = flow(x, y);
      const float z = next_depth_m(x, y);
      if (!f.valid() || !std::isfinite(z)) continue;
      const double tx = std::round(x + double{f.u}), ty = std::round(y + double{f.v});
      if (tx < 0 || ty < 0 || tx >= flow.width() || ty >= flow.height()) continue;
      float& there = depth(static_cast<int>(tx), static_cast<int>(ty));
      if (!(there <= z)) there = z;
    }
  }
  return depth;
}

std::unique_ptr<Sequence> open_sceneflow2015(const SourceSpec& source) {
  SceneFlow2015Options options;
  read_options(source.options, options, source.adapter);
  return std::make_unique<SceneFlow2015>(source, options);
}

}  // namespace sextant
