#include "sextant/datasets/kitti_layout.h"

#include <cmath>
#include <numbers>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/kitti_calibration.h"
#include "sextant/datasets/codec/kitti_labels.h"
#include "sextant/datasets/codec/kitti_png.h"
#include "sextant/datasets/codec/mots.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/kitti_oxts_track.h"

namespace sextant {
namespace {

constexpr double layout_rate_hz = 10;
constexpr int largest_id = 1000;  // MOTS: class * 1000 + id - 1
constexpr int occlusion_unknown = 3;

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
  static constexpr std::array<const char*, 5> folders = {"image_02", "image_03", "depth_02", "flow_02",
                                                         "instances"};
  static constexpr std::array<const char*, 5> texts = {"calib", "oxts", "label_02", "object_pose",
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
    for (const char* folder : folders) must_be_new(final_ / folder / name_);
    for (const char* text : texts) must_be_new(final_ / text / (name_ + ".txt"));
    if (info_.rate_hz != layout_rate_hz) {
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
            "{}: frame {} has no true camera pose, and a line of oxts "
            "cannot be left out: choose other frames with @first-last",
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
    if (object.id < 1 || object.id > largest_id) {
      fail("{}: frame {}: object id {}: MOTS holds 1 to {}", source_name(), frame, object.id, largest_id);
    }
    if (!object.size_m || !object.box) {
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
    const ImageBox& box = label.box = *object.box;
    const bool inside =
        box.left > 0 && box.top > 0 && box.right < info_.width - 1 && box.bottom < info_.height - 1;
    label.truncated = inside ? 0 : 1;
    label.occluded = occlusion_unknown;
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
    const auto folder = [&](auto channel, auto image, const char* name, const auto& encode) {
      return layout_folder(channel, image, training_ / name / name_, "{:06}.png", encode);
    };
    const auto png = [](const auto& image) { return encode_png(image); };
    LayoutFrames frames;
    frames.zero = info_.first_frame;
    frames.folders = {folder(&Channels::rgb, &Frame::rgb, "image_02", png),
                      folder(&Channels::rgb_right, &Frame::rgb_right, "image_03", png),
                      folder(&Channels::depth, &Frame::depth_m, "depth_02",
                             [](const auto& depth) { return encode_png(depth256_from_depth(depth)); }),
                      folder(&Channels::flow, &Frame::flow, "flow_02",
                             [](const auto& flow) { return encode_png(kitti_from_flow(flow)); }),
                      folder(&Channels::mask, &Frame::mask, "instances",
                             [&](const auto& mask) { return encode_png(mots_from_mask(mask, class_of_)); })};
    std::vector<std::string> mots(static_cast<size_t>(number(info_.last_frame) + 1));
    frames.also = [&](const Frame& frame) {
      const int k = number(frame.index);
      if (!frame.mask.empty()) mots[static_cast<size_t>(k)] = encode_mots_text({{k, frame.mask}}, class_of_);
    };
    write_layout_frames(sequence_, request, frames);
    std::string text;
    for (const std::string& rows : mots) text += rows;
    if (info_.channels.mask) write_text("instances_txt", text);
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
  read_options(request.options, options, "layout");
  return Writer(sequence, request, options).write(request);
}

}  // namespace sextant
