#include "sextant/datasets/sceneflow2015.h"

#include <cmath>

#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/text_rows.h"
#include "sextant/datasets/folder_sequence.h"

namespace sextant {
namespace {

constexpr int first_of_pair = 10;
constexpr double rate_hz = 10;

using Matrix34d = Eigen::Matrix<double, 3, 4>;

// Reads P_rect_02 and P_rect_03 of calib_cam_to_cam.
StereoCamera decode_camera(std::string_view text, const std::string& name) {
  std::map<std::string, Matrix34d> found;
  for (TextRows rows(text, name); rows.next();) {
    const std::string key(rows.field(0));
    if (key != "P_rect_02:" && key != "P_rect_03:") continue;
    rows.expect(13, key + " and 12 numbers (13 values)");
    Matrix34d p;
    for (int i = 0; i < 12; ++i) p(i / 4, i % 4) = rows.finite(static_cast<size_t>(i) + 1, key);
    if (!found.emplace(key, p).second) rows.fail_here("{} is repeated", key);
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

/// Returns `path` or its folder training, whichever contains image_2.
fs::path find_root(const fs::path& path) {
  if (!fs::is_directory(path)) fail("{}: no such folder", path.string());
  for (const fs::path& root : {path, path / "training"}) {
    if (fs::is_directory(root / "image_2")) return root;
  }
  fail("{}: no folder image_2 or training/image_2 in it: expected KITTI scene flow 2015", path.string());
}

std::string find_pair(const fs::path& root, const std::string& asked) {
  std::set<std::string> pairs;
  for (const auto& entry : fs::directory_iterator(root / "image_2")) {
    const std::string name = entry.path().filename().string();
    if (name.size() == 13 && name.ends_with("_10.png")) pairs.insert(name.substr(0, 6));
  }
  if (pairs.empty()) fail("{}: no images named like 000002_10.png", (root / "image_2").string());
  const std::string choices =
      fmt::format("{} pairs, {} to {}", pairs.size(), *pairs.begin(), *pairs.rbegin());
  if (asked.empty() && pairs.size() > 1) fail("{}: choose a pair with #: it has {}", root.string(), choices);
  if (asked.empty()) return *pairs.begin();
  if (!pairs.contains(asked)) fail("{}: no pair '{}': it has {}", root.string(), asked, choices);
  return asked;
}

fs::path find_calibration(const fs::path& root, const std::string& pair) {
  for (const char* folder : {"calib_cam_to_cam", "calib_cam"}) {
    fs::path path = root / folder / (pair + ".txt");
    if (fs::exists(path)) return path;
  }
  fail("{}: no such file (nor in calib_cam): it comes with the calibration files of the data set",
       (root / "calib_cam_to_cam" / (pair + ".txt")).string());
}

/// True depth of both frames.
class TrueDepth final : public DepthSource {
 public:
  TrueDepth(const fs::path& root, const std::string& pair, const ChannelInputs& inputs) : inputs_(inputs) {
    const auto path = [&](const char* folder) { return root / folder / (pair + "_10.png"); };
    first_ = path("disp_occ_0");
    second_ = path("disp_occ_1");
    flow_ = path("flow_occ");
  }

  Image<float> read(int frame) const override {
    if (frame == first_of_pair) return depth_in(first_);
    const Image<Rgb16> flow = decode_png_rgb16(inputs_.inputs->read(flow_), flow_.string());
    check_size(flow.width(), flow.height(), flow_.string(), inputs_);
    return carry_depth_along_flow(depth_in(second_), flow_from_kitti(flow));
  }
  bool has(int frame) const override {
    return frame == first_of_pair ? fs::exists(first_) : fs::exists(second_) && fs::exists(flow_);
  }
  void check_file(int frame) const override {
    const fs::path& missing = frame == first_of_pair ? first_ : fs::exists(second_) ? flow_ : second_;
    if (!has(frame)) fail_missing(missing, frame, "true depth");
  }
  std::string kind() const override { return "disparity256"; }
  std::string provenance() const override { return "depth: truth"; }

 private:
  Image<float> depth_in(const fs::path& path) const {
    const Image<uint16_t> disparity = decode_png16(inputs_.inputs->read(path), path.string());
    check_size(disparity.width(), disparity.height(), path.string(), inputs_);
    return depth_from_disparity256(disparity, inputs_.camera.bf);
  }

  fs::path first_, second_, flow_;
  ChannelInputs inputs_;
};

}  // namespace

Image<float> carry_depth_along_flow(const Image<float>& next_depth_m, const Image<Flow>& flow) {
  SEXTANT_CHECK(next_depth_m.width() == flow.width() && next_depth_m.height() == flow.height());
  Image<float> depth(flow.width(), flow.height(), NAN);
  for (const auto [x, y] : pixels(flow)) {
    const Flow f = flow(x, y);
    const float z = next_depth_m(x, y);
    if (!f.valid() || !std::isfinite(z)) continue;
    const double tx = std::round(x + double{f.u}), ty = std::round(y + double{f.v});
    if (tx < 0 || ty < 0 || tx >= flow.width() || ty >= flow.height()) continue;
    float& there = depth(static_cast<int>(tx), static_cast<int>(ty));
    if (!(there <= z)) there = z;
  }
  return depth;
}

std::unique_ptr<Sequence> open_sceneflow2015(const SourceSpec& source) {
  const auto options = options_of<SceneFlow2015Options>(source);
  const fs::path root = find_root(source.path);
  const std::string pair = find_pair(root, source.sequence);
  const fs::path calibration = find_calibration(root, pair);
  auto sequence = std::make_unique<FolderSequence>(source);
  SequenceInfo& info = sequence->info();
  info.sequence = pair;
  info.rate_hz = rate_hz;
  info.camera = decode_camera(sequence->inputs().read(calibration), calibration.string());
  info.camera.check();
  info.warnings.push_back(fmt::format(
      "{}: the data set has no poses, so there is no true motion of camera and objects", root.string()));

  const auto pattern = [&](const char* folder) { return (root / folder / (pair + "_*")).string(); };
  // The truth is the reference of a run; only an explicit option uses it as a measurement.
  const auto choice = [](const std::string& option, const char* computed) {
    return option == "truth" ? "auto" : option == "auto" ? computed : option;
  };
  FolderFiles files{.left = pattern("image_2")};
  if (has_frame_files(pattern("image_3"), ".png")) files.right = pattern("image_3");
  files.depth = {.option = choice(options.depth, "sgbm"), .files = pattern("disp_occ_0"), .exact = true};
  files.depth.open = [root, pair](const ChannelInputs& inputs) {
    return std::make_unique<TrueDepth>(root, pair, inputs);
  };
  files.flow = {
      .option = choice(options.flow, "dis"), .kind = "kitti_png", .exact = true, .provenance = "flow: truth"};
  if (options.flow == "truth" || has_frame_files(pattern("flow_occ"), ".png")) {
    files.flow.files = pattern("flow_occ");
  }
  files.masks = {.option = options.masks};
  const fs::path second = root / "image_2" / (pair + "_11.png");
  if (!fs::exists(second)) fail_missing(second, first_of_pair + 1, "image");
  sequence->choose_frames(files, root.string());
  sequence->open_channels(files);
  return sequence;
}

}  // namespace sextant
