#include "sextant/datasets/kitti_tracking.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sextant/base/files.h"
#include "sextant/base/philox.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/codec/mots.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/pose_text.h"

namespace sextant {
namespace {

/// Throws Error if the chosen frames reach beyond the samples of oxts; a sequence without oxts passes.
void check_poses(const KittiTruth& truth, const fs::path& oxts, const SequenceInfo& info) {
  if (truth.n_poses == 0 || info.last_frame < truth.n_poses) return;
  const bool none = info.first_frame >= truth.n_poses;
  fail("{}: it has frames 0-{}, but frames {}-{} are requested: complete it, or {}", oxts.string(),
       truth.n_poses - 1, info.first_frame, info.last_frame,
       none ? "remove it to run without true camera motion"
            : fmt::format("choose @{}-{}", info.first_frame, truth.n_poses - 1));
}

FolderFiles declare(const fs::path& training, const std::string& sequence,
                    const KittiTrackingOptions& options) {
  const auto folder = [&](const char* channel) { return training / channel / sequence; };
  const std::string depth = folder("depth_02").string(), flow = folder("flow_02").string();
  const std::string right = folder("image_03").string(), masks = folder("instances").string();
  const std::string masks_text = (training / "instances_txt" / (sequence + ".txt")).string();
  FolderFiles files{.left = if_there(folder("image_02")), .right = if_there(right)};
  if (options.depth == "sgbm" && files.right.empty()) {
    fail(
        "{}: no such folder, and depth = sgbm needs its right images: add it, or give option depth "
        "(disparity256:DIR, depth256:DIR, cm:DIR or none)",
        right);
  }
  files.depth = {.option = options.depth,
                 .kind = "depth256",
                 .files = if_there(depth),
                 .computed = "sgbm",
                 .if_none = fmt::format("{} and {} do not exist, so there is no depth", depth, right)};
  files.flow = {.option = options.flow,
                .kind = "kitti_png",
                .files = if_there(flow),
                .computed = "dis",
                .if_none = fmt::format("{} and images do not exist, so there is no flow", flow)};
  files.masks = {
      .option = options.masks,
      .kind = "mots_png",
      .files = if_there(masks),
      .if_none = fmt::format(
          "{} and {} do not exist, so there are no masks (option masks = boxes takes the label boxes)", masks,
          masks_text)};
  if (files.masks.files.empty() && fs::is_regular_file(masks_text)) {
    files.masks.kind = "mots_txt";
    files.masks.files = masks_text;
  }
  return files;
}

}  // namespace

void KittiTrackingOptions::check() const {
  KittiTruthOptions::check();
  RatedChannelOptions::check();
}

std::unique_ptr<Sequence> open_kitti_tracking(const SourceSpec& source) {
  const auto options = options_of<KittiTrackingOptions>(source);
  auto sequence = std::make_unique<FolderSequence>(source);
  SequenceInfo& info = sequence->info();
  KittiTruth truth = read_kitti_truth(source.path, source.sequence, options, sequence->inputs());
  sequence->truth() = std::move(truth.truth);
  info.sequence = source.sequence;
  info.camera = truth.camera;
  info.rate_hz = options.rate_hz;
  info.floor = truth.floor;
  info.faults = std::move(truth.faults);
  info.warnings = std::move(truth.warnings);
  info.provenance = std::move(truth.provenance);

  const fs::path training = fs::path(source.path) / "training";
  const std::string where = fmt::format("{}: sequence {}", training.string(), source.sequence);
  FolderFiles files = declare(training, source.sequence, options);
  if (files.left.empty()) {
    info.missing.push_back(fmt::format("{} does not exist, so there are no images",
                                       (training / "image_02" / source.sequence).string()));
    const KittiImageSize size = kitti_image_size(source.path, source.sequence, sequence->inputs());
    files.width = size.width;
    files.height = size.height;
    const int n = truth.n_poses > 0 ? truth.n_poses : truth.last_labelled_frame.value_or(-1) + 1;
    for (int frame = 0; frame < n; ++frame) files.frames.insert(frame);
    if (!size.is_known) {
      info.missing.push_back(
          fmt::format("{}: the size of the images is unknown: using {}x{}", where, size.width, size.height));
    }
  }
  sequence->choose_frames(files, where);
  check_poses(truth, training / "oxts" / (source.sequence + ".txt"), info);
  sequence->open_channels(files);
  return sequence;
}

namespace {

constexpr double origin_latitude_deg = 49.011;
constexpr double origin_longitude_deg = 8.4229;
constexpr double origin_altitude_m = 112;

double standard_normal(uint64_t seed, size_t frame) {
  PhiloxStream stream(seed, frame);
  const double u1 = stream.uniform();
  return std::sqrt(-2 * std::log(u1)) * std::cos(2 * std::numbers::pi * stream.uniform());
}

struct Sample {
  SE3 pose;
  Eigen::Vector3d velocity_mps{0, 0, 0};  ///< map axes
};

// Computes the slopes (per frame) of the twice continuously differentiable cubic spline through `p` whose
// first and last segments are parabolas: m[k-1] + 4 m[k] + m[k+1] = 3 (p[k+1] - p[k-1]), m[0] + m[1] = 2
// (p[1] - p[0]).
std::vector<Eigen::Vector3d> spline_slopes(const std::vector<SE3>& p) {
  const size_t n = p.size();
  const auto step = [&](size_t i, size_t j) -> Eigen::Vector3d {
    return p[j].translation() - p[i].translation();
  };
  if (n == 2) return {step(0, 1), step(0, 1)};
  std::vector<double> diagonal(n, 4);
  std::vector<Eigen::Vector3d> m(n);
  diagonal.front() = diagonal.back() = 1;
  m.front() = 2 * step(0, 1);
  m.back() = 2 * step(n - 2, n - 1);
  for (size_t k = 1; k + 1 < n; ++k) m[k] = 3 * step(k - 1, k + 1);
  for (size_t k = 1; k < n; ++k) {  // the off-diagonal entries are all 1
    diagonal[k] -= 1 / diagonal[k - 1];
    m[k] -= m[k - 1] / diagonal[k - 1];
  }
  m.back() /= diagonal.back();
  for (size_t k = n - 1; k > 0; --k) m[k - 1] = (m[k - 1] - m[k]) / diagonal[k - 1];
  return m;
}

// The track as a function of time.
class Curve {
 public:
  Curve(std::vector<SE3> poses, double rate_hz) : poses_(std::move(poses)), rate_hz_(rate_hz) {
    if (poses_.size() > 1) slopes_ = spline_slopes(poses_);
  }

  Sample at(size_t frame, double delay_s) const {
    if (poses_.size() == 1) return {poses_[0]};
    const double time = static_cast<double>(frame) + delay_s * rate_hz_;  // in frames
    const auto last = static_cast<double>(poses_.size() - 2);
    const auto i = static_cast<size_t>(std::clamp(std::floor(time), 0.0, last));
    return between(i, time - static_cast<double>(i));
  }

 private:
  const Eigen::Vector3d& position(size_t i) const { return poses_[i].translation(); }

  Sample between(size_t i, double s) const {
    const Eigen::Vector3d step = position(i + 1) - position(i);
    const Eigen::Vector3d& m0 = slopes_[i];
    const Eigen::Vector3d& m1 = slopes_[i + 1];
    const Eigen::Vector3d c2 = 3 * step - 2 * m0 - m1;
    const Eigen::Vector3d c3 = m0 + m1 - 2 * step;
    const Eigen::Vector3d omega = so3_log(poses_[i].rotation().conjugate() * poses_[i + 1].rotation());
    const Eigen::Quaterniond rotation = poses_[i].rotation() * so3_exp(s * omega);
    return {SE3(rotation, position(i) + s * (m0 + s * (c2 + s * c3))),
            (m0 + s * (2 * c2 + 3 * s * c3)) * rate_hz_};
  }

  std::vector<SE3> poses_;
  std::vector<Eigen::Vector3d> slopes_;
  double rate_hz_;
};

// Maps x right, y down, z ahead to x east, y north, z up; ahead becomes east, as at yaw 0.
SE3 map_from_world() {
  Eigen::Matrix3d r;
  r << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return SE3(Eigen::Quaterniond(r), Eigen::Vector3d::Zero());
}

}  // namespace

std::vector<KittiOxts> oxts_of_track(const std::vector<SE3>& T_world_camera, double rate_hz,
                                     const SE3& T_camera_imu, const OxtsJitter& jitter) {
  if (T_world_camera.empty()) return {};
  std::vector<SE3> imu;
  imu.reserve(T_world_camera.size());
  for (const SE3& T : T_world_camera) imu.push_back(map_from_world() * T * T_camera_imu);
  const Curve curve(std::move(imu), rate_hz);
  std::vector<Sample> samples;
  samples.reserve(T_world_camera.size());
  for (size_t k = 0; k < T_world_camera.size(); ++k) {
    samples.push_back(curve.at(k, jitter.sigma_s > 0 ? jitter.sigma_s * standard_normal(jitter.seed, k) : 0));
  }

  const double scale = mercator_scale(origin_latitude_deg);
  KittiOxts origin{.latitude_deg = origin_latitude_deg,
                   .longitude_deg = origin_longitude_deg,
                   .altitude_m = origin_altitude_m};
  const Eigen::Vector3d move =
      pose_from_oxts(origin, scale).translation() - samples.front().pose.translation();
  std::vector<KittiOxts> track;
  track.reserve(samples.size());
  for (const Sample& sample : samples) {
    const SE3 moved(sample.pose.rotation(), sample.pose.translation() + move);
    KittiOxts& oxts = track.emplace_back(oxts_from_pose(moved, scale));
    oxts.east_mps = sample.velocity_mps.x();
    oxts.north_mps = sample.velocity_mps.y();
    oxts.velocity_mps = Eigen::AngleAxisd(-oxts.yaw_rad, Eigen::Vector3d::UnitZ()) * sample.velocity_mps;
  }
  return track;
}

namespace {

constexpr double layout_rate_hz = 10;
constexpr int largest_id = 1000;  // MOTS: class * 1000 + id - 1
constexpr int occlusion_unknown = 3;

// Sensor positions of KITTI's car to the decimetre: laser scanner with x ahead, y left, z up, 0.27 m behind
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

double wrapped_angle(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

class KittiWriter {
 public:
  KittiWriter(const Sequence& sequence, const LayoutRequest& request, const KittiLayoutOptions& options)
      : sequence_(sequence),
        info_(sequence.info()),
        options_(options),
        final_(request.out / "training"),
        training_(request.folder() / "training"),
        name_(request.sequence.empty() ? fmt::format("{:04}", default_number(info_.sequence))
                                       : request.sequence) {}

  std::string write(const LayoutRequest& request) {
    check_request();
    // Text files first, so that content that the format cannot represent is found before images are written.
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
      fail("sequence name '{}': expected one such as 0005, without any of the characters / \\ # @", name_);
    }
    const auto must_be_new = [](const fs::path& path) {
      if (fs::exists(path))
        fail("{}: exists already: remove it, or choose another sequence name", path.string());
    };
    for (const char* folder : folders) must_be_new(final_ / folder / name_);
    for (const char* text : texts) must_be_new(final_ / text / (name_ + ".txt"));
    if (info_.rate_hz != layout_rate_hz) {
      fail("{}: {} Hz, but the KITTI layout cannot store a rate: expected 10 Hz", source_name(),
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
      fail("{}: frame {}: object id {}: expected an id from 1 to {}", source_name(), frame, object.id,
           largest_id);
    }
    if (!object.size_m || !object.box) {
      fail("{}: frame {}: object {} has no {}, which a KITTI label needs: take a source whose truth has it",
           source_name(), frame, object.id, object.size_m ? "2-D box" : "size");
    }
    if (object.type.find_first_of(" \t\r\n") != std::string::npos) {
      fail("{}: frame {}: object {} is of type '{}': expected a single word, as in KITTI labels",
           source_name(), frame, object.id, object.type);
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
    label.rotation_y_rad = wrapped_angle(std::atan2(ahead.x(), ahead.z()) - std::numbers::pi / 2);
    label.alpha_rad =
        wrapped_angle(label.rotation_y_rad - std::atan2(label.position_m.x(), label.position_m.z()));
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
  fs::path final_;     ///< final training/ folder
  fs::path training_;  ///< training/ folder into which the files are written first
  std::string name_;
  std::map<int, int> class_of_;                      ///< MOTS class by object id
  std::map<std::pair<int, int>, SE3> object_poses_;  ///< by frame and track as written
};

}  // namespace

void KittiLayoutOptions::check() const {
  check_option(std::isfinite(oxts_jitter_ms) && oxts_jitter_ms >= 0, "oxts_jitter_ms", oxts_jitter_ms,
               "finite and >= 0");
}

std::string write_kitti_layout(const Sequence& sequence, const LayoutRequest& request) {
  KittiLayoutOptions options;
  read_options(request.options, options, "layout");
  return KittiWriter(sequence, request, options).write(request);
}

}  // namespace sextant
