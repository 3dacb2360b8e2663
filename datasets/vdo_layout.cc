#include "sextant/datasets/vdo_layout.h"

#include <cmath>
#include <numbers>

#include "sextant/datasets/codec/flo.h"
#include "sextant/datasets/codec/kitti_png.h"
#include "sextant/datasets/codec/mask_text.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/text_rows.h"
#include "sextant/datasets/codec/yaml_camera.h"

namespace sextant {
namespace {

constexpr int largest_frame = 999'999;  // six digits

std::string times_text(const SequenceInfo& info) {
  std::string text;
  for (int frame = 0; frame <= info.last_frame; ++frame) {
    const auto known = info.times_s.find(frame);
    text += fmt::format("{:.9f}\n", known == info.times_s.end() ? frame / info.rate_hz : known->second);
  }
  return text;
}

std::string poses_text(const Sequence& sequence) {
  std::map<int, SE3> poses;
  for (const auto& [frame, pose] : sequence.truth().camera.poses()) {
    if (frame >= sequence.info().first_frame && frame <= sequence.info().last_frame) poses[frame] = pose;
  }
  return encode_pose_text(poses);
}

std::string objects_text(const Sequence& sequence) {
  std::string text;
  for (const auto& [frame, objects] : sequence.truth().objects) {
    if (frame < sequence.info().first_frame || frame > sequence.info().last_frame) continue;
    for (const ObjectTruth& object : objects) {
      const Eigen::Vector3d& p = object.T_camera_object.translation();
      const Eigen::Vector3d ahead = object.T_camera_object.rotation() * Eigen::Vector3d::UnitZ();
      const double ry =
          std::remainder(std::atan2(ahead.x(), ahead.z()) - std::numbers::pi / 2, 2 * std::numbers::pi);
      const ImageBox box = object.box.value_or(ImageBox{0, 0, 0, 0});
      put_line(text, frame, object.id, box.left, box.top, box.right, box.bottom, p.x(), p.y(), p.z(), ry);
    }
  }
  return text;
}

std::vector<LayoutFolder> folders(const fs::path& root, double bf) {
  const auto png = [](const auto& image) { return encode_png(image); };
  const auto disparity = [bf](const auto& depth) { return encode_png(disparity256_from_depth(depth, bf)); };
  return {layout_folder(&Channels::rgb, &Frame::rgb, root / "image_0", "{:06}.png", png),
          layout_folder(&Channels::depth, &Frame::depth_m, root / "depth", "{:06}.png", disparity),
          layout_folder(&Channels::flow, &Frame::flow, root / "flow", "{:06}.flo", encode_flo),
          layout_folder(&Channels::mask, &Frame::mask, root / "semantic", "{:06}.txt", encode_mask_text)};
}

}  // namespace

std::string write_vdo_layout(const Sequence& sequence, const LayoutRequest& request) {
  const SequenceInfo& info = sequence.info();
  if (request.sequence.find_first_of("/\\#@") != std::string::npos) {
    fail("sequence name '{}': expected one such as 0005, without / # @", request.sequence);
  }
  if (info.first_frame < 0 || info.last_frame > largest_frame) {
    fail("{} sequence {}: frames {}-{}: file names of this layout hold 0 to {}", info.dataset, info.sequence,
         info.first_frame, info.last_frame, largest_frame);
  }
  const fs::path final_folder = request.out / request.sequence;
  for (const char* name : {"image_0", "depth", "flow", "semantic", "pose_gt.txt"}) {
    if (fs::exists(final_folder / name)) {
      fail("{}: is there already: remove it, or choose another folder or sequence name",
           (final_folder / name).string());
    }
  }
  const fs::path folder = (request.stage.empty() ? request.out : request.stage) / request.sequence;
  fs::create_directories(folder);
  write_layout_frames(sequence, request, {.folders = folders(folder, info.camera.bf)});
  write_file(folder / "camera.yaml", encode_yaml_camera({info.camera, info.rate_hz}));
  write_file(folder / "times.txt", times_text(info));
  if (!sequence.truth().camera.empty()) write_file(folder / "pose_gt.txt", poses_text(sequence));
  if (!sequence.truth().objects.empty()) write_file(folder / "object_pose.txt", objects_text(sequence));
  std::string path = final_folder.string();
  if (request.sequence.empty() && path.size() > 1 && path.back() == '/') path.pop_back();
  return "vdo:" + path;
}

}  // namespace sextant
