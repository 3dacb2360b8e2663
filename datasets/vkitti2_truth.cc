#include "sextant/datasets/vkitti2_truth.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "sextant/datasets/codec/vkitti2_text.h"
#include "sextant/datasets/codec/vkitti_box.h"

namespace sextant {
namespace {

// The data set's extrinsics have seven digits, of numbers up to some hundred metres.
constexpr double rectified = 0.02;  // m, rad

class Reader {
 public:
  Reader(const fs::path& folder, int camera, InputLog& inputs)
      : folder_(folder), camera_(camera), inputs_(inputs) {}

  Vkitti2Truth read() {
    read_extrinsics();
    read_intrinsics();
    read_objects();
    return std::move(out_);
  }

 private:
  fs::path path(const char* file) const { return folder_ / file; }

  // The rows of a file; empty with a warning when it is not there.
  template <typename Row>
  std::vector<Row> rows(const char* file, std::vector<Row> (*decode)(std::string_view, const std::string&),
                        const char* consequence) {
    if (!fs::is_regular_file(path(file))) {
      out_.warnings.push_back(fmt::format("no {}: {}", path(file).string(), consequence));
      return {};
    }
    return decode(inputs_.read(path(file)), path(file).string());
  }

  void read_extrinsics() {
    const auto all = rows("extrinsic.txt", decode_vkitti2_extrinsics, "no true camera motion");
    std::set<int> cameras;
    std::map<int, std::map<int, SE3>> by_frame;
    for (const Vkitti2Extrinsic& row : all) {
      cameras.insert(row.camera);
      by_frame[row.frame].emplace(row.camera, row.T_camera_world);
      if (row.camera == camera_) out_.truth.camera.set(row.frame, row.T_camera_world.inverse());
    }
    if (!all.empty() && !cameras.contains(camera_)) {
      fail("{}: no rows of camera {}; there: {}: take the option camera = {}", path("extrinsic.txt").string(),
           camera_, fmt::join(cameras, ", "), *cameras.begin());
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
        "same baseline in every frame (here {:.6f} m, {:.6f} off)",
        path("extrinsic.txt").string(), frame, baseline_m, off);
  }

  void read_intrinsics() {
    const auto all =
        rows("intrinsic.txt", decode_vkitti2_intrinsics, "taking f = 725.0087, c = (620.5, 187)");
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
    const auto poses = rows("pose.txt", decode_vkitti2_poses, "no true object motion");
    const auto boxes = rows("bbox.txt", decode_vkitti2_boxes, "objects have no boxes");
    const auto infos = rows("info.txt", decode_vkitti2_infos, "objects have no types");
    for (const Vkitti2Box& row : boxes) {
      if (row.camera == camera_) boxes_[{row.frame, row.track}] = row;
    }
    for (const Vkitti2Info& row : infos) types_[row.track] = row.label;
    for (const Vkitti2Pose& row : poses) {
      if (row.camera == camera_) add_object(row);
    }
    for (auto& [frame, list] : out_.truth.objects) std::ranges::sort(list, {}, &ObjectTruth::id);
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
  return Reader(folder, camera, inputs).read();
}

}  // namespace sextant
