#include "sextant/datasets/kitti_layout.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sextant/base/files.h"
#include "sextant/base/parallel_for.h"
#include "sextant/base/progress.h"
#include "sextant/datasets/codec/kitti_calibration.h"
#include "sextant/datasets/codec/kitti_labels.h"
#include "sextant/datasets/codec/kitti_png.h"
#include "sextant/datasets/codec/mots.h"
#include "sextant/datasets/codec/object_pose_text.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/kitti_oxts_track.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

constexpr double kRateHz = 10;
constexpr int kLargestId = 1000;  // MOTS: class * 1000 + id - 1
constexpr int kOcclusionUnknown = 3;

// Sensors where KITTI's car has them, to the decimetre: laser scanner x ahead, y left, z up, 0.27 m behind
// and 0.08 m above the camera; GPS/IMU unit with the same axes.
KittiCalibration make_calibration(const StereoCamera& camera) {
  KittiCalibration c;
  for (size_t i = 0; i < 4; ++i) {
    const double right = i % 2 == 1 ? -camera.bf : 0;
    c.P.at(i) << camera.left.fx, 0, camera.left.cx, right, 0, camera.left.fy, camera.left.cy, 0, 0, 0, 1, 0;
  }
  c.Tr_velo_to_cam << 0, -1, 0, 0, 0, 0, -1, -0.08, 1, 0, 0, -0.27;
  c.Tr_imu_to_velo << 1, 0, 0, -0.81, 0, 1, 0, 0.32, 0, 0, 1, -0.80;
  return c;
}

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

class Writer {
 public:
  Writer(const Sequence& sequence, const LayoutRequest& request, const KittiLayoutOptions& options)
      : sequence_(sequence),
        info_(sequence.info()),
        options_(options),
        final_(request.out / "training"),
        training_((request.stage.empty() ? request.out : request.stage) / "training"),
        name_(request.sequence.empty() ? fmt::format("{:04}", default_number(info_.sequence))
                                       : request.sequence) {}

  std::string write(const LayoutRequest& request) {
    check_request();
    // Text first: what the format cannot hold is found before the images.
    const std::string oxts = make_oxts();
    const std::string labels = encode_kitti_labels(make_labels());
    write_frames(request);
    if (!oxts.empty()) write_text("oxts", oxts);
    if (!sequence_.truth().objects.empty()) {
      write_text("object_pose", encode_object_poses(object_poses_));
      write_text("label_02", labels);
    }
    write_text("calib", encode_kitti_calibration(make_calibration(info_.camera)));
    return fmt::format("kitti:{}#{}", request.out.string(), name_);
  }

 private:
  static constexpr std::array<const char*, 5> kFolders = {"image_02", "image_03", "depth_02", "flow_02",
                                                          "instances"};
  static constexpr std::array<const char*, 5> kTexts = {"calib", "oxts", "label_02", "object_pose",
                                                        "instances_txt"};

  int number(int frame) const { return frame - info_.first_frame; }
  fs::path text_path(const char* what) const { return training_ / what / (name_ + ".txt"); }
  std::string source_name() const { return fmt::format("{} sequence {}", info_.dataset, info_.sequence); }

  void check_request() const {
    if (name_.find_first_of("/\\#@") != std::string::npos) {
      fail("sequence name '{}': expected one such as 0005, without / # @", name_);
    }
    const auto must_be_new = [](const fs::path& path) {
      if (fs::exists(path))
        fail("{}: is there already: remove it, or choose another sequence name", path.string());
    };
    for (const char* folder : kFolders) must_be_new(final_ / folder / name_);
    for (const char* text : kTexts) must_be_new(final_ / text / (name_ + ".txt"));
    if (info_.rate_hz != kRateHz) {
      fail("{}: {} Hz, and the KITTI layout has no place for a rate: expected 10 Hz", source_name(),
           info_.rate_hz);
    }
  }

  std::string make_oxts() const {
    const Trajectory& camera = sequence_.truth().camera;
    if (camera.empty()) return {};
    std::vector<SE3> poses;
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      const std::optional<SE3> pose = camera.pose(frame);
      if (!pose) {
        fail(
            "{}: frame {} has no true camera pose, and a line of oxts cannot be left out: choose other "
            "frames "
            "with @first-last",
            source_name(), frame);
      }
      poses.push_back(*pose);
    }
    const KittiCalibration c = make_calibration(info_.camera);
    const SE3 T_camera_imu = SE3::from_matrix(c.Tr_velo_to_cam) * SE3::from_matrix(c.Tr_imu_to_velo);
    return encode_kitti_oxts(
        oxts_of_track(poses, info_.rate_hz, T_camera_imu, {options_.oxts_jitter_ms / 1000, options_.seed}));
  }

  std::vector<KittiLabel> make_labels() {
    std::vector<KittiLabel> labels;
    for (const auto& [frame, objects] : sequence_.truth().objects) {
      if (frame < info_.first_frame || frame > info_.last_frame) continue;
      for (const ObjectTruth& object : objects) labels.push_back(make_label(frame, object));
    }
    return labels;
  }

  KittiLabel make_label(int frame, const ObjectTruth& object) {
    if (object.id < 1 || object.id > kLargestId) {
      fail("{}: frame {}: object id {}: MOTS holds 1 to {}", source_name(), frame, object.id, kLargestId);
    }
    if (!object.size_m || !object.left || !object.top || !object.right || !object.bottom) {
      fail("{}: frame {}: object {} has no {}, which a KITTI label needs", source_name(), frame, object.id,
           object.size_m ? "2-D box" : "size");
    }
    if (object.type.find_first_of(" \t\r\n") != std::string::npos) {
      fail("{}: frame {}: object {} is of type '{}': a KITTI label holds one word", source_name(), frame,
           object.id, object.type);
    }
    KittiLabel label;
    label.frame = number(frame);
    label.track_id = object.id - 1;
    label.type = object.type.empty() ? "Car" : object.type;
    label.left = *object.left;
    label.top = *object.top;
    label.right = *object.right;
    label.bottom = *object.bottom;
    const bool inside =
        label.left > 0 && label.top > 0 && label.right < info_.width - 1 && label.bottom < info_.height - 1;
    label.truncated = inside ? 0 : 1;
    label.occluded = kOcclusionUnknown;
    label.width_m = object.size_m->x();
    label.height_m = object.size_m->y();
    label.length_m = object.size_m->z();
    label.position_m = object.T_camera_object.translation();
    object_poses_.emplace(std::pair(label.frame, label.track_id), object.T_camera_object);
    const Eigen::Vector3d ahead = object.T_camera_object.rotation() * Eigen::Vector3d::UnitZ();
    label.rotation_y_rad = wrapped(std::atan2(ahead.x(), ahead.z()) - std::numbers::pi / 2);
    label.alpha_rad = wrapped(label.rotation_y_rad - std::atan2(label.position_m.x(), label.position_m.z()));
    const bool person =
        label.type == "Pedestrian" || label.type == "Person" || label.type == "Person_sitting";
    class_of_[object.id] = person ? 2 : 1;
    return label;
  }

  void write_frames(const LayoutRequest& request) {
    const Channels& has = info_.channels;
    const Channels wanted{
        .rgb = has.rgb, .rgb_right = has.rgb_right, .depth = has.depth, .flow = has.flow, .mask = has.mask};
    const bool any = has.rgb || has.rgb_right || has.depth || has.flow || has.mask;
    if (!any) return;
    for (const char* folder : kFolders) {
      if (has_folder(folder)) fs::create_directories(training_ / folder / name_);
    }
    const int n = info_.last_frame - info_.first_frame + 1;
    std::vector<std::string> mots(static_cast<size_t>(n));
    Progress progress("frames written", n, request.quiet);
    parallel_for(n, request.jobs, [&](int i) {
      if (request.between_frames) request.between_frames();
      mots[static_cast<size_t>(i)] = write_frame(sequence_.read(info_.first_frame + i, wanted));
      progress.advance();
    });
    if (!has.mask) return;
    std::string text;
    for (const std::string& rows : mots) text += rows;
    write_text("instances_txt", text);
  }

  bool has_folder(std::string_view folder) const {
    const Channels& has = info_.channels;
    return folder == "image_02"   ? has.rgb
           : folder == "image_03" ? has.rgb_right
           : folder == "depth_02" ? has.depth
           : folder == "flow_02"  ? has.flow
                                  : has.mask;
  }

  // Returns the frame's rows of instances_txt.
  std::string write_frame(const Frame& frame) const {
    const int k = number(frame.index);
    if (!frame.rgb.empty()) write_png("image_02", k, encode_png(frame.rgb));
    if (!frame.rgb_right.empty()) write_png("image_03", k, encode_png(frame.rgb_right));
    if (!frame.depth_m.empty()) write_png("depth_02", k, encode_png(depth256_from_depth(frame.depth_m)));
    if (!frame.flow.empty()) write_png("flow_02", k, encode_png(kitti_from_flow(frame.flow)));
    if (frame.mask.empty()) return {};
    write_png("instances", k, encode_png(mots_from_mask(frame.mask, class_of_)));
    return encode_mots_text({{k, frame.mask}}, class_of_);
  }

  void write_png(const char* folder, int k, const std::string& bytes) const {
    write_file(training_ / folder / name_ / fmt::format("{:06}.png", k), bytes);
  }

  void write_text(const char* what, const std::string& text) const {
    fs::create_directories(training_ / what);
    write_file(text_path(what), text);
  }

  const Sequence& sequence_;
  const SequenceInfo& info_;
  const KittiLayoutOptions& options_;
  fs::path final_;     ///< training/ where it will be
  fs::path training_;  ///< training/ where files are written
  std::string name_;
  std::map<int, int> class_of_;                      ///< MOTS class by object id
  std::map<std::pair<int, int>, SE3> object_poses_;  ///< by frame and track as written
};

}  // namespace

void KittiLayoutOptions::check() const {
  check_option(std::isfinite(oxts_jitter_ms) && oxts_jitter_ms >= 0, "oxts_jitter_ms", oxts_jitter_ms,
               ">= 0");
}

std::string write_kitti_layout(const Sequence& sequence, const LayoutRequest& request) {
  KittiLayoutOptions options;
  read_options(request.options, options, "kitti");
  return Writer(sequence, request, options).write(request);
}

}  // namespace sextant
