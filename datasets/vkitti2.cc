#include "sextant/datasets/vkitti2.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>
#include <set>

#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/vkitti1.h"
#include "sextant/datasets/vkitti_layout.h"

namespace sextant {
namespace {

// Tolerance for a rectified pair: the extrinsics have seven digits, for values of up to some hundred metres.
constexpr double rectified = 0.02;  // m, rad

class Vkitti2Reader {
 public:
  Vkitti2Reader(const fs::path& folder, int camera, InputLog& inputs)
      : folder_(folder), camera_(camera), inputs_(inputs) {}

  Vkitti2Truth read() {
    read_extrinsics();
    read_intrinsics();
    read_objects();
    return std::move(out_);
  }

 private:
  fs::path path(const char* file) const { return folder_ / file; }

  // Returns the rows of a file; empty with a warning if it does not exist.
  template <typename Row>
  std::vector<Row> rows(const char* file, std::vector<Row> (*decode)(std::string_view, const std::string&),
                        const char* consequence) {
    if (!fs::is_regular_file(path(file))) {
      out_.warnings.push_back(fmt::format("{} does not exist: {}", path(file).string(), consequence));
      return {};
    }
    return decode(inputs_.read(path(file)), path(file).string());
  }

  void read_extrinsics() {
    const auto all = rows("extrinsic.txt", decode_vkitti2_extrinsics, "there is no true camera motion");
    std::set<int> cameras;
    std::map<int, std::map<int, SE3>> by_frame;
    for (const Vkitti2Extrinsic& row : all) {
      cameras.insert(row.camera);
      by_frame[row.frame].emplace(row.camera, row.T_camera_world);
      if (row.camera == camera_) out_.truth.camera.set(row.frame, row.T_camera_world.inverse());
    }
    if (!all.empty() && !cameras.contains(camera_)) {
      fail("{}: no rows of camera {}; available: {}: take the option camera = {}",
           path("extrinsic.txt").string(), camera_, fmt::join(cameras, ", "), *cameras.begin());
    }
    for (const auto& [frame, poses] : by_frame) check_baseline(frame, poses);
  }

  void check_baseline(int frame, const std::map<int, SE3>& poses) {
    if (!poses.contains(0) || !poses.contains(1)) return;
    const SE3 T_right_left = poses.at(1) * poses.at(0).inverse();
    const double baseline_m = -T_right_left.translation().x();
    const double off = std::max(T_right_left.translation().tail<2>().cwiseAbs().maxCoeff(),
                                rotation_angle_rad(T_right_left.rotation()));
    const bool first = !out_.baseline_m;
    if (first) out_.baseline_m = baseline_m;
    if (baseline_m > 0 && off < rectified && std::abs(baseline_m - *out_.baseline_m) < rectified) {
      return;
    }
    fail(
        "{}: frame {}: the cameras are not a rectified pair with the "
        "same baseline in every frame: baseline {:.6f} m (first frame: {:.6f} m); other offsets and rotation "
        "up to {:.6f} m or rad, expected less than 0.02",
        path("extrinsic.txt").string(), frame, baseline_m, *out_.baseline_m, off);
  }

  void read_intrinsics() {
    const auto all = rows("intrinsic.txt", decode_vkitti2_intrinsics, "using f = 725.0087, c = (620.5, 187)");
    int first_frame = 0;
    for (const Vkitti2Intrinsic& row : all) {
      if (row.camera != camera_) continue;
      const PinholeCamera& k = row.k;
      if (!out_.camera) {
        out_.camera = k;
        first_frame = row.frame;
      }
      const PinholeCamera& first = *out_.camera;
      if (k.fx == first.fx && k.fy == first.fy && k.cx == first.cx && k.cy == first.cy) continue;
      fail(
          "{}: the camera of frame {} ({} {} {} {}) differs from that "
          "of frame {} ({} {} {} {}): it has to be the same in all",
          path("intrinsic.txt").string(), row.frame, k.fx, k.fy, k.cx, k.cy, first_frame, first.fx, first.fy,
          first.cx, first.cy);
    }
    if (!all.empty() && !out_.camera) {
      fail("{}: no rows of camera {}", path("intrinsic.txt").string(), camera_);
    }
  }

  void read_objects() {
    const auto poses = rows("pose.txt", decode_vkitti2_poses, "there is no true object motion");
    const auto boxes = rows("bbox.txt", decode_vkitti2_boxes, "objects have no boxes");
    const auto infos = rows("info.txt", decode_vkitti2_infos, "objects have no types");
    require_camera("pose.txt", poses, "there is no true object motion");
    require_camera("bbox.txt", boxes, "objects have no boxes");
    for (const Vkitti2Box& row : boxes) {
      if (row.camera == camera_) boxes_[{row.frame, row.track}] = row;
    }
    for (const Vkitti2Info& row : infos) types_[row.track] = row.label;
    for (const Vkitti2Pose& row : poses) {
      if (row.camera == camera_) add_object(row);
    }
    for (auto& [frame, list] : out_.truth.objects) std::ranges::sort(list, {}, &ObjectTruth::id);
  }

  /// Warns if a file has rows, but none of the camera in use.
  template <typename Row>
  void require_camera(const char* file, const std::vector<Row>& rows, const char* consequence) {
    std::set<int> cameras;
    for (const Row& row : rows) cameras.insert(row.camera);
    if (cameras.empty() || cameras.contains(camera_)) return;
    out_.warnings.push_back(fmt::format("{}: no rows of camera {}, only of camera {}: {}",
                                        path(file).string(), camera_, fmt::join(cameras, ", "), consequence));
  }

  void add_object(const Vkitti2Pose& row) {
    const std::string name = path("pose.txt").string();
    if (!out_.truth.camera.empty() && !out_.truth.camera.has(row.frame)) {
      fail("{}: it has objects in frame {}, of which {} has no pose: take both files from the same sequence",
           name, row.frame, path("extrinsic.txt").string());
    }
    ObjectTruth object;
    object.id = row.track + 1;
    object.T_camera_object = SE3(vkitti_rotation(row.camera_angles), row.camera_m);
    object.size_m = row.size_m;
    if (!boxes_.empty()) {
      const auto box = boxes_.find({row.frame, row.track});
      if (box == boxes_.end()) {
        fail("{}: no row of track {} in frame {} of camera {}, which {} has", path("bbox.txt").string(),
             row.track, row.frame, row.camera, name);
      }
      object.box = box->second.box;
      object.moving = box->second.is_moving;
    }
    if (!types_.empty()) {
      const auto type = types_.find(row.track);
      if (type == types_.end()) {
        fail("{}: no row of track {}, which {} has", path("info.txt").string(), row.track, name);
      }
      object.type = type->second;
    }
    out_.truth.objects[row.frame].push_back(std::move(object));
  }

  fs::path folder_;
  int camera_;
  InputLog& inputs_;
  Vkitti2Truth out_;
  std::map<std::pair<int, int>, Vkitti2Box> boxes_;  // by frame and track
  std::map<int, std::string> types_;                 // by track
};

}  // namespace

Vkitti2Truth read_vkitti2_truth(const fs::path& folder, int camera, InputLog& inputs) {
  return Vkitti2Reader(folder, camera, inputs).read();
}

namespace {

// Camera of the release, used if a text file does not define it.
const PinholeCamera release_camera{725.0087, 725.0087, 620.5, 187.0};
constexpr double baseline_digits_m = 2e-3;  // precision of the release's extrinsics

constexpr const char* archives[] = {"textgt",      "rgb",          "depth",
                                    "forwardFlow", "backwardFlow", "instanceSegmentation"};

std::vector<fs::path> roots(const fs::path& root) {
  std::vector<fs::path> all = {root};
  for (const char* archive : archives) all.push_back(root / fmt::format("vkitti_2.0.3_{}", archive));
  return all;
}

std::set<std::string> subfolders(const std::vector<fs::path>& folders, const std::string& start) {
  std::set<std::string> names;
  for (const fs::path& folder : folders) {
    if (!fs::is_directory(folder)) continue;
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_directory() && name.starts_with(start)) names.insert(name);
    }
  }
  return names;
}

// Location of the scene below the root.
class Place {
 public:
  explicit Place(const SourceSpec& source) : root_(source.path), name_(parse_vkitti2_name(source.sequence)) {
    if (!fs::is_directory(root_)) fail("{}: no such folder", root_.string());
    const std::set<std::string> scenes = subfolders(roots(root_), "Scene");
    if (scenes.empty()) {
      fail("{}: no Virtual KITTI 2 in it: expected folders such as Scene01/clone", root_.string());
    }
    if (source.sequence.empty()) {
      fail("source '{}': choose a scene: {}:{}#<scene>/<variation>; available: {}", source.text,
           source.adapter, source.path, fmt::join(scenes, ", "));
    }
    if (!scenes.contains(name_.group)) {
      fail("{}: no scene '{}' in it; available: {}", root_.string(), name_.group, fmt::join(scenes, ", "));
    }
    std::vector<fs::path> places;
    for (const fs::path& place : roots(root_)) places.push_back(place / name_.group);
    const std::set<std::string> variations = subfolders(places, "");
    if (name_.variation.empty() || !variations.contains(name_.variation)) {
      fail("{}: {} has no variation '{}' in it; available: {}", root_.string(), name_.group, name_.variation,
           fmt::join(variations, ", "));
    }
  }

  std::string sequence() const { return name_.text(); }

  /// Returns the folder of one kind of frames; empty if it does not exist.
  std::string frames(const char* kind, int camera) const {
    for (const fs::path& root : roots(root_)) {
      const fs::path base = root / name_.group / name_.variation / "frames" / kind;
      const std::string found = if_there(base / fmt::format("Camera_{}", camera));
      if (!found.empty()) return found;
    }
    return "";
  }

  // Returns the folder of the text files, existing or not.
  fs::path text() const {
    for (const fs::path& root : roots(root_)) {
      const fs::path folder = root / name_.group / name_.variation;
      for (const char* file : {"extrinsic.txt", "pose.txt", "intrinsic.txt", "bbox.txt", "info.txt"}) {
        if (fs::is_regular_file(folder / file)) return folder;
      }
    }
    return root_ / name_.group / name_.variation;
  }

 private:
  fs::path root_;
  VkittiName name_;
};

void choose_camera(const Vkitti2Truth& text, SequenceInfo& info) {
  info.camera.left = text.camera.value_or(release_camera);
  double baseline_m = vkitti_baseline_m;
  if (text.baseline_m && std::abs(*text.baseline_m - vkitti_baseline_m) > baseline_digits_m) {
    baseline_m = *text.baseline_m;
    info.warnings.push_back(
        fmt::format("baseline of {:.6f} m, as in extrinsic.txt: the data set has {:.6f} m", baseline_m,
                    vkitti_baseline_m));
  }
  info.camera.bf = info.camera.left.fx * baseline_m;
  info.camera.check();
}

}  // namespace

void Vkitti2Options::check() const {
  RatedChannelOptions::check();
  check_option(camera == 0 || camera == 1, "camera", camera, "0 or 1");
}

std::unique_ptr<Sequence> open_vkitti2(const SourceSpec& source) {
  const auto options = options_of<Vkitti2Options>(source);
  const Place place(source);
  auto sequence = std::make_unique<FolderSequence>(source);
  SequenceInfo& info = sequence->info();
  info.sequence = place.sequence();
  info.rate_hz = options.rate_hz;
  Vkitti2Truth text = read_vkitti2_truth(place.text(), options.camera, sequence->inputs());
  sequence->truth() = std::move(text.truth);
  info.warnings = std::move(text.warnings);
  choose_camera(text, info);

  FolderFiles files = vkitti_files(sequence->truth());
  files.left = place.frames("rgb", options.camera);
  if (options.camera == 0) files.right = place.frames("rgb", 1);
  files.depth = {.option = options.depth,
                 .kind = "cm",
                 .files = place.frames("depth", options.camera),
                 .computed = "sgbm",
                 .exact = true};
  files.flow = {.option = options.flow,
                .kind = "vkitti_png",
                .files = place.frames("forwardFlow", options.camera),
                .computed = "dis",
                .exact = true};
  files.backward_flow = {.kind = "vkitti_png", .files = place.frames("backwardFlow", options.camera)};
  files.masks = {.option = options.masks,
                 .kind = "instance_png",
                 .files = place.frames("instanceSegmentation", options.camera)};
  sequence->choose_frames(files, fmt::format("{} {}", source.path, info.sequence));
  check_vkitti_frames(*sequence, source.path);
  sequence->open_channels(files);
  return sequence;
}

}  // namespace sextant
