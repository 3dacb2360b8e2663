#include <algorithm>
#include <map>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/kitti_png.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/vkitti2_text.h"
#include "sextant/datasets/vkitti_files.h"
#include "sextant/datasets/vkitti_layout.h"
#include "sextant/datasets/vkitti_rows.h"

namespace sextant {
namespace {

constexpr int left_camera = 0;
constexpr int right_camera = 1;

Vkitti2Pose to_pose(const VkittiRow& row, const SE3& T_world_camera) {
  Vkitti2Pose pose;
  pose.frame = row.frame;
  pose.camera = left_camera;
  pose.track = row.track;
  pose.alpha = row.alpha_rad;
  pose.size_m = *row.object->size_m;
  const SE3 T_world_object = T_world_camera * row.object->T_camera_object;
  pose.world_m = T_world_object.translation();
  pose.world_angles = vkitti_angles(T_world_object.rotation());
  pose.camera_m = row.object->T_camera_object.translation();
  pose.camera_angles = row.angles;
  return pose;
}

// 8 bit where that is enough, as in the data set.
std::string encode_instances(const Image<uint16_t>& mask) {
  if (*std::max_element(mask.data(), mask.data() + mask.size()) > 255) return encode_png(mask);
  Image<uint8_t> narrow(mask.width(), mask.height());
  std::transform(mask.data(), mask.data() + mask.size(), narrow.data(),
                 [](uint16_t id) { return static_cast<uint8_t>(id); });
  return encode_png(narrow);
}

class Writer {
 public:
  Writer(const Sequence& sequence, const LayoutRequest& request)
      : sequence_(sequence), info_(sequence.info()), request_(request) {
    const std::string name =
        request.sequence.empty() ? std::to_string(default_number(info_.sequence)) : request.sequence;
    name_ = parse_vkitti2_name(name);
    if (!name_.group.starts_with("Scene") || name_.variation.empty() ||
        name_.variation.find('/') != std::string::npos) {
      fail("sequence '{}': expected a scene and a variation, such as Scene18/clone", name);
    }
    folder_ = (request.stage.empty() ? request.out : request.stage) / name_.group / name_.variation;
    if (fs::exists(request.out / name_.group / name_.variation)) {
      fail("{}: {} is there already: remove it, or choose another folder or sequence", request.out.string(),
           name_.text());
    }
    check_vkitti_poses(sequence);
  }

  std::string write() {
    fs::create_directories(folder_);
    const auto frames = [&](auto channel, auto image, const char* kind, int camera, const char* name,
                            const auto& encode) {
      return layout_folder(channel, image, folder_ / "frames" / kind / fmt::format("Camera_{}", camera), name,
                           encode);
    };
    const auto jpeg = [](const Image<Rgb>& image) { return encode_jpeg(image); };
    const auto depth = [](const Image<float>& depth_m) { return encode_png(cm_from_depth(depth_m)); };
    const auto flow = [](const Image<Flow>& image) { return encode_png(vkitti_from_flow(image)); };
    const auto outlines = write_vkitti_frames(
        sequence_, request_,
        {frames(&Channels::rgb, &Frame::rgb, "rgb", left_camera, "rgb_{:05}.jpg", jpeg),
         frames(&Channels::rgb_right, &Frame::rgb_right, "rgb", right_camera, "rgb_{:05}.jpg", jpeg),
         frames(&Channels::depth, &Frame::depth_m, "depth", left_camera, "depth_{:05}.png", depth),
         frames(&Channels::flow, &Frame::flow, "forwardFlow", left_camera, "flow_{:05}.png", flow),
         frames(&Channels::backward_flow, &Frame::backward_flow, "backwardFlow", left_camera,
                "backwardFlow_{:05}.png", flow),
         frames(&Channels::mask, &Frame::mask, "instanceSegmentation", left_camera, "instancegt_{:05}.png",
                encode_instances)});
    write_cameras();
    if (!sequence_.truth().camera.empty()) write_objects(outlines);
    put("colors.txt", vkitti2_colors());
    return fmt::format("vkitti2:{}#{}", request_.out.string(), name_.text());
  }

 private:
  void put(const char* file, std::string_view bytes) const { write_file(folder_ / file, bytes); }

  void write_cameras() const {
    const Trajectory& camera = sequence_.truth().camera;
    const SE3 T_right_left(Eigen::Quaterniond::Identity(),
                           {-info_.camera.bf / info_.camera.left.fx, 0.0, 0.0});
    std::vector<Vkitti2Extrinsic> extrinsics;
    std::vector<Vkitti2Intrinsic> intrinsics;
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      for (const int id : {left_camera, right_camera}) intrinsics.push_back({frame, id, info_.camera.left});
      if (camera.empty()) continue;
      const SE3 T_left_world = camera.pose(frame)->inverse();
      extrinsics.push_back({frame, left_camera, T_left_world});
      extrinsics.push_back({frame, right_camera, T_right_left * T_left_world});
    }
    put("intrinsic.txt", encode_vkitti2_intrinsics(intrinsics));
    if (!extrinsics.empty()) put("extrinsic.txt", encode_vkitti2_extrinsics(extrinsics));
  }

  void write_objects(const std::map<int, MaskOutlines>& outlines) const {
    std::vector<Vkitti2Pose> poses;
    std::vector<Vkitti2Box> boxes;
    std::map<int, Vkitti2Info> infos;  // by track
    for (const VkittiRow& row : vkitti_rows(sequence_, outlines)) {
      poses.push_back(to_pose(row, *sequence_.truth().camera.pose(row.frame)));
      boxes.push_back({row.frame, left_camera, row.track, row.box, row.n_pixels, row.truncation,
                       row.occupancy, row.moving});
      infos.emplace(row.track, Vkitti2Info{row.track, row.type, "unknown", "unknown"});
    }
    std::vector<Vkitti2Info> info_rows;
    for (const auto& [track, info] : infos) info_rows.push_back(info);
    put("pose.txt", encode_vkitti2_poses(poses));
    put("bbox.txt", encode_vkitti2_boxes(boxes));
    put("info.txt", encode_vkitti2_infos(info_rows));
  }

  const Sequence& sequence_;
  const SequenceInfo& info_;
  const LayoutRequest& request_;
  VkittiName name_;
  fs::path folder_;
};

}  // namespace

std::string write_vkitti2_layout(const Sequence& sequence, const LayoutRequest& request) {
  return Writer(sequence, request).write();
}

}  // namespace sextant
