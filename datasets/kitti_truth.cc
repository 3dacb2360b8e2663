#include "sextant/datasets/kitti_truth.h"

#include <fmt/ranges.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "sextant/base/files.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/codec/mots.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/folder_sequence.h"
#include "sextant/datasets/kitti_oxts.h"

namespace sextant {
namespace {

Eigen::Matrix4d homogeneous(const Eigen::Matrix<double, 3, 4>& m) {
  Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
  out.topRows<3>() = m;
  return out;
}

Eigen::Matrix4d camera_from_imu(const KittiCalibration& calibration, bool rectified) {
  Eigen::Matrix4d unrectified =
      homogeneous(calibration.Tr_velo_to_cam) * homogeneous(calibration.Tr_imu_to_velo);
  if (!rectified) return unrectified;
  Eigen::Matrix4d rectify = Eigen::Matrix4d::Identity();
  rectify.topLeftCorner<3, 3>() = calibration.R_rect;
  rectify.topRightCorner<3, 1>() = calibration.offset_m(2);
  return rectify * unrectified;
}

/// The truth of the GPS/IMU unit: raw poses, corrected according to the options.
class ImuTruth {
 public:
  ImuTruth(const std::vector<KittiOxts>& samples, const StepFloor& steps,
           const std::optional<CourseFit>& course, const KittiTruthOptions& options)
      : samples_(samples), steps_(steps), course_(course), options_(options) {}

  void correct(std::vector<SE3>& poses) const {
    Eigen::Vector3d position = poses.front().translation();
    Eigen::Vector3d before = position;
    for (size_t i = 0; i + 1 < poses.size(); ++i) {
      const Eigen::Vector3d raw = poses[i + 1].translation() - before;
      before = poses[i + 1].translation();
      position += step(i, raw);
      poses[i + 1] = SE3(poses[i + 1].rotation(), position);
    }
    if (options_.heading != KittiHeading::course || !course_) return;
    for (size_t k = 0; k < poses.size(); ++k) {
      const Eigen::AngleAxisd turn(course_->slow_rad[k], Eigen::Vector3d::UnitZ());
      poses[k] = {turn * poses[k].rotation(), poses[k].translation()};
    }
  }

 private:
  Eigen::Vector3d step(size_t i, const Eigen::Vector3d& raw) const {
    const double speed = kitti_mean_speed_mps(samples_, i);
    if (!(speed > kitti_slow_mps)) return raw;
    switch (options_.velocity) {
      case KittiVelocity::raw:
        return raw;
      case KittiVelocity::velocity_corrected:
        return raw.norm() > 0 ? Eigen::Vector3d(raw * (steps_.mean_s * speed / raw.norm())) : raw;
      case KittiVelocity::velocity_vector:
        return steps_.mean_s * velocity_mps(i, options_.heading == KittiHeading::course);
      case KittiVelocity::velocity_heading:
        break;
    }
    const double slow = course_ ? (course_->slow_rad[i] + course_->slow_rad[i + 1]) / 2 : 0;
    return Eigen::AngleAxisd(-slow, Eigen::Vector3d::UnitZ()) * (steps_.mean_s * velocity_mps(i, true));
  }

  /// Returns the mean velocity over the ends of step i, in the axes of the positions.
  Eigen::Vector3d velocity_mps(size_t i, bool later) const {
    const Eigen::Vector3d at = samples_[i].map_velocity_mps(), next = samples_[i + 1].map_velocity_mps();
    const Eigen::Vector3d mean = (at + next) / 2;
    return later ? Eigen::Vector3d(mean + options_.velocity_lag_s / steps_.mean_s * (next - at)) : mean;
  }

  const std::vector<KittiOxts>& samples_;
  const StepFloor& steps_;
  const std::optional<CourseFit>& course_;
  const KittiTruthOptions& options_;
};

// Matrices instead of SE3: with seven digits in the files, A differs from a rotation by 1e-7, which over 200
// m of track is visible in the comparison with the authors' numbers.
Trajectory camera_poses(const std::vector<SE3>& imu, const Eigen::Matrix4d& A) {
  const Eigen::Matrix4d A_inverse = A.inverse();
  const SE3 to_first = imu.front().inverse();
  Trajectory camera;
  for (size_t k = 0; k < imu.size(); ++k) {
    const Eigen::Matrix4d m = A * (to_first * imu[k]).matrix() * A_inverse;
    camera.set(static_cast<int>(k), SE3::from_matrix(m.topRows<3>()));
  }
  return camera;
}

using ObjectPoses = std::map<std::pair<int, int>, SE3>;  // by frame and track

SE3 pose_of(const KittiLabel& label, const ObjectPoses& poses) {
  const auto given = poses.find({label.frame, label.track_id});
  if (given != poses.end()) return given->second;
  const double yaw = label.rotation_y_rad + std::numbers::pi / 2;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())), label.position_m};
}

ObjectTruth object_of(const KittiLabel& label, const ObjectPoses& poses, const Eigen::Vector3d& offset_m) {
  ObjectTruth object;
  object.id = label.track_id + 1;
  const SE3 T_camera0_object = pose_of(label, poses);
  object.T_camera_object = SE3(T_camera0_object.rotation(), T_camera0_object.translation() + offset_m);
  object.box = label.box;
  object.size_m = Eigen::Vector3d(label.width_m, label.height_m, label.length_m);
  object.type = label.type;
  return object;
}

ObjectTruths objects_of(const std::vector<KittiLabel>& labels, const ObjectPoses& poses,
                        const Eigen::Vector3d& offset_m) {
  ObjectTruths objects;
  for (const KittiLabel& label : labels) {
    if (!label.dont_care()) objects[label.frame].push_back(object_of(label, poses, offset_m));
  }
  for (auto& [frame, list] : objects) std::ranges::sort(list, {}, &ObjectTruth::id);
  mark_interpolated(objects);
  return objects;
}

void check_sequence(const fs::path& root, const std::string& sequence) {
  if (!fs::is_directory(root)) fail("{}: no such folder", root.string());
  const fs::path calib = root / "training" / "calib";
  if (!fs::is_directory(calib)) {
    fail("{}: no folder training/calib in it: expected the folder that holds training/ of KITTI tracking",
         root.string());
  }
  if (!sequence.empty() && fs::is_regular_file(calib / (sequence + ".txt"))) return;
  std::set<std::string> known;
  for (const auto& entry : fs::directory_iterator(calib)) {
    if (entry.path().extension() == ".txt") known.insert(entry.path().stem().string());
  }
  fail("{}: no {}: give the sequence after '#' (such as #0005); there are: {}", calib.string(),
       sequence.empty() ? "sequence is asked for" : sequence + ".txt",
       known.empty() ? "none" : fmt::format("{}", fmt::join(known, " ")));
}

class KittiTruthReader {
 public:
  KittiTruthReader(const fs::path& root, const std::string& sequence, const KittiTruthOptions& options,
                   InputLog& inputs)
      : training_(root / "training"), file_(sequence + ".txt"), options_(options), inputs_(inputs) {}

  KittiTruth read() {
    const fs::path path = training_ / "calib" / file_;
    calibration_ = decode_kitti_calibration(inputs_.read(path), path.string());
    choose_camera(path);
    read_poses();
    read_objects();
    return out_;
  }

 private:
  bool rectified() const { return options_.ground_truth == KittiPoses::rectified; }

  void choose_camera(const fs::path& path) {
    out_.camera.left = calibration_.camera(2);
    const bool grey = options_.bf_preset == KittiPair::grey;
    out_.camera.bf = options_.bf > 0 ? options_.bf : grey ? calibration_.grey_bf() : calibration_.colour_bf();
    if (!(out_.camera.bf > 0)) {
      fail(
          "{}: focal length times baseline is {:.7g} by {}: "
          "expected a number above 0, from a left and a right camera: correct the file, or give option bf",
          path.string(), out_.camera.bf, grey ? "P0(0,3) - P1(0,3)" : "P2(0,3) - P3(0,3)");
    }
    out_.camera.check();
    out_.provenance.push_back(
        fmt::format("camera: P2, bf = {:.7g} ({})", out_.camera.bf,
                    options_.bf > 0 ? "given" : fmt::format("{} pair", to_string(options_.bf_preset))));
  }

  void read_poses() {
    const fs::path path = training_ / "oxts" / file_;
    if (!fs::exists(path)) {
      out_.warnings.push_back(
          fmt::format("{} does not exist, so there is no true camera motion", path.string()));
      return;
    }
    const std::vector<KittiOxts> samples = decode_kitti_oxts(inputs_.read(path), path.string());
    out_.n_poses = static_cast<int>(samples.size());
    std::vector<SE3> imu = kitti_imu_poses(samples);
    const std::optional<StepFloor> steps = kitti_step_floor(samples);
    const bool still = !steps && kitti_moves(samples);
    if (still) report_still(samples, path);
    const std::string faults = still ? "" : kitti_position_faults(samples, imu, path);
    if (!faults.empty()) add_fault(faults);
    const std::string differing = kitti_differing_velocities(samples, path);
    if (!differing.empty() && needs_direction()) {
      fail("{}: {} requires them to agree within 0.1 m/s: take velocity = raw and heading = yaw", differing,
           options_.heading == KittiHeading::course
               ? std::string("heading = course")
               : fmt::format("velocity = {}", to_string(options_.velocity)));
    }
    std::optional<CourseFit> course;
    if (steps && differing.empty()) course = kitti_course(samples, steps->mean_s, options_.velocity_lag_s);
    if (steps) ImuTruth(samples, *steps, course, options_).correct(imu);
    out_.truth.camera = camera_poses(imu, camera_from_imu(calibration_, rectified()));
    out_.provenance.push_back(fmt::format("camera truth: oxts, {}, {}, heading = {}",
                                          to_string(options_.ground_truth), to_string(options_.velocity),
                                          to_string(options_.heading)));
    if (!steps) {
      add_accuracy(fmt::format("camera truth floor: unknown, {}",
                               still ? "the positions do not change" : "no step is faster than 1 m/s"));
      return;
    }
    report_floor(samples, imu, *steps, course);
  }

  void add_fault(const std::string& text) {
    out_.warnings.push_back(text);
    out_.faults.push_back(text);
  }

  void add_accuracy(const std::string& text) {
    out_.provenance.push_back(text);
    out_.accuracy.push_back(text);
  }

  /// Reports positions that do not change although the car moves; an error if the options require steps.
  void report_still(const std::vector<KittiOxts>& samples, const fs::path& path) {
    const std::string text = fmt::format(
        "{}: the positions do not change, although the measured speed is up to {:.4g} m/s: had the receiver "
        "no fix?",
        path.string(), kitti_top_speed_mps(samples));
    if (options_.velocity != KittiVelocity::raw || options_.heading == KittiHeading::course) {
      fail(
          "{} Options velocity = {} and heading = {} require the time between positions: take velocity = "
          "raw and heading = yaw",
          text, to_string(options_.velocity), to_string(options_.heading));
    }
    add_fault(text + " The true camera motion is wrong");
  }

  bool needs_direction() const {
    return options_.velocity == KittiVelocity::velocity_vector ||
           options_.velocity == KittiVelocity::velocity_heading || options_.heading == KittiHeading::course;
  }

  void report_floor(const std::vector<KittiOxts>& samples, const std::vector<SE3>& imu,
                    const StepFloor& steps, const std::optional<CourseFit>& course) {
    const bool corrected = options_.velocity != KittiVelocity::raw;
    TruthFloor& floor = out_.floor;
    floor = kitti_pose_floor(imu, samples, steps, course ? course->lever_m : 0);
    if (!corrected) out_.truth.camera_step_floor_m = steps.floor_m;
    add_accuracy(fmt::format(
        "camera truth floor: raw steps scatter by {:.4f} m RMS around speed x {:.4f} s ({} steps){}; their "
        "component perpendicular to the measured velocity is {:.4f} m RMS",
        steps.floor_m, steps.mean_s, steps.n_steps, corrected ? " and are replaced by it" : "",
        steps.across_m));
    if (!course) return;
    add_accuracy(fmt::format(
        "camera truth heading: course minus yaw ranges from {:.2f} to {:.2f} deg, lever arm {:.2f} m; the "
        "component of the true steps perpendicular to the heading is {:.4f} m RMS (lever arm subtracted); "
        "errors of the rotations: {:.4f} (timing alone) to {} deg RMS",
        course->lowest_deg, course->highest_deg, course->lever_m, *floor.lateral_m,
        *floor.rotation_timing_deg,
        floor.rotation_deg ? fmt::format("{:.4f} (turn rates)", *floor.rotation_deg)
                           : "an unknown number of"));
  }

  void read_objects() {
    const fs::path path = training_ / "label_02" / file_;
    if (!fs::exists(path)) {
      out_.warnings.push_back(
          fmt::format("{} does not exist, so there is no true object motion", path.string()));
      return;
    }
    const std::vector<KittiLabel> labels = decode_kitti_labels(inputs_.read(path), path.string());
    for (const KittiLabel& label : labels) {
      out_.last_labelled_frame = std::max(out_.last_labelled_frame.value_or(0), label.frame);
    }
    const Eigen::Vector3d offset_m = rectified() ? calibration_.offset_m(2) : Eigen::Vector3d::Zero();
    const ObjectPoses poses = read_object_poses(labels);
    out_.truth.objects = objects_of(labels, poses, offset_m);
    out_.provenance.push_back(
        fmt::format("object truth: label_02, id = track id + 1, positions in {}{}",
                    rectified() ? "camera 2" : "rectified camera 0",
                    poses.empty() ? "" : fmt::format("; {} poses of object_pose", poses.size())));
  }

  // Poses that replace those of the labels; empty if there is no such file.
  ObjectPoses read_object_poses(const std::vector<KittiLabel>& labels) {
    const fs::path path = training_ / "object_pose" / file_;
    if (!fs::exists(path)) return {};
    ObjectPoses poses = decode_object_poses(inputs_.read(path), path.string());
    std::set<std::pair<int, int>> labelled;
    for (const KittiLabel& label : labels) labelled.emplace(label.frame, label.track_id);
    for (const auto& [key, pose] : poses) {
      if (labelled.contains(key)) continue;
      fail("{}: track {} has a pose in frame {}, but no row in {}: take both from the same sequence",
           path.string(), key.second, key.first, (training_ / "label_02" / file_).string());
    }
    return poses;
  }

  fs::path training_;
  std::string file_;
  const KittiTruthOptions& options_;
  InputLog& inputs_;
  KittiCalibration calibration_;
  KittiTruth out_;
};

}  // namespace

void KittiTruthOptions::check() const {
  check_option(std::isfinite(bf) && bf >= 0, "bf", bf, "finite, 0 (by bf_preset) or larger");
  check_option(std::abs(velocity_lag_s) <= 1, "velocity_lag_s", velocity_lag_s, "-1 to 1");
  if (heading == KittiHeading::course && velocity == KittiVelocity::velocity_heading) {
    fail(
        "options heading = course and velocity = velocity_heading: the first turns the heading to the "
        "velocity, the second the velocity to the heading: give one of them");
  }
}

KittiTruth read_kitti_truth(const fs::path& root, const std::string& sequence,
                            const KittiTruthOptions& options, InputLog& inputs) {
  check_sequence(root, sequence);
  return KittiTruthReader(root, sequence, options, inputs).read();
}

KittiImageSize kitti_image_size(const fs::path& root, const std::string& sequence, InputLog& inputs) {
  const fs::path path = root / "training" / "instances_txt" / (sequence + ".txt");
  if (!fs::exists(path)) return {};
  const MotsText text(inputs.read(path), path.string());
  const std::set<int> frames = text.frames();
  if (frames.empty()) return {};
  const MotsText::Row& row = text.rows(*frames.begin()).front();
  return {row.width, row.height, true};
}

}  // namespace sextant
