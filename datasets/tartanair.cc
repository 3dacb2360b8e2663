#include "sextant/datasets/tartanair.h"

#include <fmt/ranges.h>

#include <cmath>

#include "sextant/datasets/codec/text_rows.h"
#include "sextant/geometry/axes.h"

namespace sextant {
namespace {

constexpr const char* poses_file = "pose_lcam_front.txt";
constexpr const char* images_folder = "image_lcam_front";
constexpr double norm_limit = 0.01;  // largest deviation of a quaternion's norm from 1

bool is_trajectory(const fs::path& folder) {
  return fs::exists(folder / poses_file) || fs::is_directory(folder / images_folder);
}

/// Returns the names of up to 20 trajectories ENV/Data_easy/P000 below a folder.
std::set<std::string> trajectories(const fs::path& root) {
  constexpr int deepest = 2;
  constexpr size_t most = 20;
  std::set<std::string> names;
  std::error_code ignored;
  for (auto it =
           fs::recursive_directory_iterator(root, fs::directory_options::skip_permission_denied, ignored);
       it != fs::recursive_directory_iterator() && names.size() < most; it.increment(ignored)) {
    if (ignored) break;
    if (!it->is_directory(ignored)) continue;
    const bool found = is_trajectory(it->path());
    if (found) names.insert(it->path().lexically_relative(root).string());
    if (found || it.depth() == deepest) it.disable_recursion_pending();
  }
  return names;
}

fs::path find_trajectory(const SourceSpec& source) {
  const fs::path root = source.path;
  if (!fs::is_directory(root)) fail("{}: no such folder", root.string());
  const fs::path folder = source.sequence.empty() ? root : root / source.sequence;
  if (is_trajectory(folder)) return folder;
  const std::set<std::string> known = trajectories(root);
  if (known.empty()) {
    fail("{}: no {} and no folder {} in it or below: expected the folder of a trajectory of TartanAir V2",
         folder.string(), poses_file, images_folder);
  }
  fail("source '{}': choose a trajectory: {}:{}#ENV/Data_easy/P000; available: {}", source.text,
       source.adapter, source.path, fmt::join(known, ", "));
}

/// Returns "ENV/Data_easy/P000" for a folder in such a hierarchy, otherwise its own name.
std::string name_of(const SourceSpec& source, const fs::path& folder) {
  if (!source.sequence.empty()) return source.sequence;
  fs::path whole = fs::absolute(folder).lexically_normal();
  if (whole.filename().empty()) whole = whole.parent_path();
  const std::string difficulty = whole.parent_path().filename().string();
  if (!difficulty.starts_with("Data_")) return whole.filename().string();
  return fmt::format("{}/{}/{}", whole.parent_path().parent_path().filename().string(), difficulty,
                     whole.filename().string());
}

/// Reads T_world_camera in opencv axes, by line.
Trajectory decode_poses(std::string_view text, const std::string& name) {
  const SE3 T_opencv_ned(Eigen::Quaterniond(opencv_from_axes(Axes::ned)), Eigen::Vector3d::Zero());
  const SE3 T_ned_opencv = T_opencv_ned.inverse();
  Trajectory poses;
  int frame = 0;
  for (TextRows rows(text, name, ' ', '#'); rows.next(); ++frame) {
    rows.expect(7, "tx ty tz qx qy qz qw (7 values)");
    const Eigen::Vector3d position(rows.metres(0, "tx"), rows.metres(1, "ty"), rows.metres(2, "tz"));
    const Eigen::Quaterniond q(rows.finite(6, "qw"), rows.finite(3, "qx"), rows.finite(4, "qy"),
                               rows.finite(5, "qz"));
    if (!(std::abs(q.norm() - 1) <= norm_limit))
      rows.fail_here("quaternion of norm {:.4g}, expected 1: are the columns tx ty tz qx qy qz qw?",
                     q.norm());
    poses.set(frame, T_opencv_ned * SE3(q, position) * T_ned_opencv);
  }
  if (poses.empty()) fail("{}: holds no pose: expected lines of tx ty tz qx qy qz qw", name);
  return poses;
}

/// Masks of a static scene: all pixels are background.
class StaticMasks final : public MaskSource {
 public:
  explicit StaticMasks(const ChannelInputs& inputs) : inputs_(inputs) {}

  Image<uint16_t> read(int frame) const override {
    const Image<Rgb> image = inputs_.left(frame);
    return Image<uint16_t>(image.width(), image.height());
  }
  std::string provenance() const override { return text; }

  static constexpr const char* text = "masks: background alone, the scenes are static";

 private:
  ChannelInputs inputs_;
};

}  // namespace

std::unique_ptr<Sequence> open_tartanair(const SourceSpec& source) {
  const auto options = options_of<TartanairOptions>(source);
  const fs::path folder = find_trajectory(source);
  auto sequence = std::make_unique<FolderSequence>(source);
  SequenceInfo& info = sequence->info();
  info.sequence = name_of(source, folder);
  info.rate_hz = options.rate_hz;
  info.camera.left = {tartanair_focal_px, tartanair_focal_px, tartanair_size_px / 2.0,
                      tartanair_size_px / 2.0};
  info.camera.bf = tartanair_focal_px * tartanair_baseline_m;

  const auto part = [&](const char* name) { return if_there(folder / name); };
  FolderFiles files{.left = part(images_folder), .right = part("image_rcam_front")};
  files.depth = {.option = options.depth,
                 .kind = "tartanair_png",
                 .files = part("depth_lcam_front"),
                 .computed = "sgbm",
                 .exact = true};
  files.flow = {.option = options.flow,
                .kind = "tartanair_png",
                .files = part("flow_lcam_front"),
                .computed = "dis",
                .exact = true};
  files.masks = {.option = options.masks, .files = part(images_folder)};
  files.masks.provenance = StaticMasks::text;
  files.masks.open = [](const ChannelInputs& inputs) { return std::make_unique<StaticMasks>(inputs); };
  files.width = files.height = tartanair_size_px;

  const fs::path poses = folder / poses_file;
  Trajectory& camera = sequence->truth().camera;
  if (fs::exists(poses)) {
    camera = decode_poses(sequence->inputs().read(poses), poses.string());
    for (const auto& [frame, pose] : camera.poses()) files.frames.insert(frame);
  } else {
    info.warnings.push_back(
        fmt::format("{} does not exist, so there is no true camera motion", poses.string()));
  }
  sequence->choose_frames(files, folder.string());
  if (!camera.empty() && !camera.has(info.last_frame)) {
    fail("{}: it has {} lines, but frame {} needs line {}: complete it, or choose @{}-{}", poses.string(),
         camera.poses().size(), info.last_frame, info.last_frame + 1, info.first_frame,
         camera.poses().size() - 1);
  }
  if (info.width != tartanair_size_px || info.height != tartanair_size_px) {
    fail(
        "{}: images of {}x{} pixels: the data set's camera (f = 320, c = (320, 320)) belongs to {}x{}; "
        "take images of that size",
        folder.string(), info.width, info.height, tartanair_size_px, tartanair_size_px);
  }
  sequence->open_channels(files);
  return sequence;
}

}  // namespace sextant
