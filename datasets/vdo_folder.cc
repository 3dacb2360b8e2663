#include "sextant/datasets/vdo_folder.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

// KITTI tracking 0003, left colour camera. The authors' demo uses the bf of the grey pair although its images
// and depth are from the colour pair: depth is 0.8 % too large. bf_preset = colour corrects that. The
// reproduction uses the bf that the folder's own settings state, as the authors did.
constexpr int demo_width = 1242;
constexpr int demo_height = 375;
constexpr double authors_bf = 387.5744;
constexpr double colour_bf = 384.3814;
constexpr double default_rate_hz = 10;

/// Camera and truth of a folder with known frames and image size.
class TextFiles {
 public:
  /// `images`: numbers of all images of the folder.
  TextFiles(fs::path dir, const std::set<int>& images, FolderSequence& sequence)
      : dir_(std::move(dir)),
        first_image_(*images.begin()),
        last_image_(*images.rbegin()),
        sequence_(sequence),
        info_(sequence.info()) {}

  void read(const VdoFolderOptions& options) {
    choose_camera(options);
    read_times();
    read_truth();
    warn_about_other_number_of_times();
  }

  /// Warns if the factor of the camera file is not the one by which the depth files are decoded.
  void warn_about_depth_factor() {
    static const std::map<std::string, double> factors = {
        {"disparity256", 256}, {"depth256", 256}, {"cm", 100}};
    const auto in_use = factors.find(info_.depth_kind);
    if (!depth_map_factor_ || in_use == factors.end() || *depth_map_factor_ == in_use->second) return;
    info_.warnings.push_back(fmt::format(
        "{}: DepthMapFactor = {:g} is not used: depth is read as {}, whose factor is {:g}; if the files have "
        "another one, convert them, or give the option depth",
        camera_file_, *depth_map_factor_, info_.depth_kind, in_use->second));
  }

 private:
  void choose_camera(const VdoFolderOptions& options) {
    const bool complete =
        options.fx > 0 && options.fy > 0 && options.cx > 0 && options.cy > 0 && options.bf > 0;
    YamlCamera found;
    if (const auto yaml = find_yaml(complete)) {
      found = decode_yaml_camera(sequence_.inputs().read(*yaml), yaml->string());
      camera_file_ = yaml->string();
    } else if (!complete) {
      need_demo_size("no *.yaml camera in this folder: add one, or give the options fx, fy, cx, cy and bf");
      found.camera = {{721.5377, 721.5377, 609.5593, 172.8540}, authors_bf};
      info_.warnings.push_back(
          fmt::format("no *.yaml camera in {}: using the KITTI 0003 demo's "
                      "f = 721.5377, c = (609.5593, 172.8540), bf = 387.5744",
                      dir_.string()));
    }
    if (options.bf_preset == VdoPair::colour) {
      need_demo_size("option bf_preset = colour is that of KITTI 0003: give the option bf instead");
      found.camera.bf = colour_bf;
    }
    const auto override_with = [](double option, double& value) { value = option > 0 ? option : value; };
    override_with(options.fx, found.camera.left.fx);
    override_with(options.fy, found.camera.left.fy);
    override_with(options.cx, found.camera.left.cx);
    override_with(options.cy, found.camera.left.cy);
    override_with(options.bf, found.camera.bf);
    warn_about_distortion(found.distortion);
    depth_map_factor_ = found.depth_map_factor;
    info_.camera = found.camera;
    info_.camera.check();
    info_.rate_hz = options.rate_hz > 0 ? options.rate_hz
                    : found.rate_hz > 0 ? found.rate_hz
                                        : default_rate_hz;
    rate_is_assumed_ = !(options.rate_hz > 0) && !(found.rate_hz > 0);
  }

  void warn_about_distortion(const std::map<std::string, double>& coefficients) {
    if (coefficients.empty()) return;
    std::vector<std::string> shown;
    for (const auto& [key, value] : coefficients) shown.push_back(fmt::format("{} = {:g}", key, value));
    info_.warnings.push_back(fmt::format(
        "{}: the lens distortion {} is not used, because images, depth and flow are expected to be "
        "rectified: if they are, set these values to 0; otherwise rectify them, and write the camera of the "
        "rectified images",
        camera_file_, fmt::join(shown, ", ")));
  }

  // Finds the folder's camera file. If options define the camera completely, several files are not ambiguous.
  std::optional<fs::path> find_yaml(bool complete) const {
    std::set<fs::path> files;
    for (const auto& entry : fs::directory_iterator(dir_)) {
      const fs::path& path = entry.path();
      if (path.extension() == ".yaml" || path.extension() == ".yml") files.insert(path);
    }
    if (files.empty()) return std::nullopt;
    if (files.size() > 1 && complete) return std::nullopt;
    if (files.size() > 1) {
      fail("{}: {} camera files (such as {} and {}): keep one, or give the options fx, fy, cx, cy and bf",
           dir_.string(), files.size(), files.begin()->filename().string(),
           files.rbegin()->filename().string());
    }
    return *files.begin();
  }

  void need_demo_size(const char* message) const {
    if (info_.width == demo_width && info_.height == demo_height) return;
    fail("{}: {} (KITTI 0003 has {}x{} pixels, these images {}x{})", dir_.string(), message, demo_width,
         demo_height, info_.width, info_.height);
  }

  // Line k is the time of frame k.
  void read_times() {
    const fs::path path = dir_ / "times.txt";
    if (!fs::exists(path)) {
      if (rate_is_assumed_) {
        info_.warnings.push_back(
            fmt::format("no frame rate in a *.yaml and no {}: assuming {} Hz; "
                        "velocities are proportional to the rate (change it with the option rate_hz)",
                        path.string(), default_rate_hz));
      }
      return;
    }
    std::vector<double> times;
    const std::string text = sequence_.inputs().read(path);
    for (TextRows rows(text, path.string()); rows.next();) times.push_back(rows.finite(0, "a time"));
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      if (static_cast<size_t>(frame) < times.size()) info_.times_s[frame] = times[static_cast<size_t>(frame)];
    }
    n_times_ = static_cast<int>(times.size());
    if (times.size() < 2) return;
    const double step_s = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
    if (std::abs(step_s * info_.rate_hz - 1) > 0.01) {
      info_.warnings.push_back(
          fmt::format("{}: steps of {:.4g} s, but the rate is {:.4g} Hz: "
                      "using the rate (change it with the option rate_hz)",
                      path.string(), step_s, info_.rate_hz));
    }
  }

  // Line k is the time of frame k, so a missing or additional line shifts all times after it. The files of a
  // longer sequence, of which the folder has the first images, also have poses of later frames.
  void warn_about_other_number_of_times() {
    if (!n_times_) return;
    const int n_frames = last_image_ + 1;
    const auto& poses = sequence_.truth().camera.poses();
    const bool of_longer_sequence = !poses.empty() && *n_times_ <= poses.rbegin()->first + 1;
    if (*n_times_ == n_frames || (*n_times_ > n_frames && of_longer_sequence)) return;
    info_.warnings.push_back(fmt::format(
        "{}: {} lines for the frames 0 to {}, of which each needs one: line k + 1 is taken as the "
        "time of frame k",
        (dir_ / "times.txt").string(), *n_times_, last_image_));
  }

  void read_truth() {
    const fs::path poses = dir_ / "pose_gt.txt";
    if (fs::exists(poses)) {
      for (const auto& [frame, pose] : decode_pose_text(sequence_.inputs().read(poses), poses.string())) {
        sequence_.truth().camera.set(frame, pose);  // T_world_camera
      }
      warn_about_frames_without_pose(poses);
    } else {
      info_.warnings.push_back(
          fmt::format("{} does not exist, so there is no true camera motion", poses.string()));
    }
    const fs::path objects = dir_ / "object_pose.txt";
    if (fs::exists(objects)) {
      sequence_.truth().objects = decode_vdo_objects(sequence_.inputs().read(objects), objects.string());
      warn_about_objects_of_other_frames(objects);
    } else {
      info_.warnings.push_back(
          fmt::format("{} does not exist, so there is no true object motion", objects.string()));
    }
  }

  void warn_about_objects_of_other_frames(const fs::path& path) {
    const ObjectTruths& objects = sequence_.truth().objects;
    if (objects.empty()) return;
    const int first = objects.begin()->first, last = objects.rbegin()->first;
    if (objects.lower_bound(first_image_) != objects.upper_bound(last_image_)) return;
    info_.warnings.push_back(
        fmt::format("{}: its rows are of the frames {} to {}, but the images are of the frames {} to {}, so "
                    "there is no true object motion: are the frames numbered differently?",
                    path.string(), first, last, first_image_, last_image_));
  }

  void warn_about_frames_without_pose(const fs::path& poses) {
    std::vector<int> missing;
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      if (!sequence_.truth().camera.has(frame)) missing.push_back(frame);
    }
    if (missing.empty()) return;
    info_.warnings.push_back(fmt::format("{}: no pose for {} of {} frames, the first is {}", poses.string(),
                                         missing.size(), info_.last_frame - info_.first_frame + 1,
                                         missing.front()));
  }

  fs::path dir_;
  int first_image_ = 0, last_image_ = 0;  // of the folder, of which the source may be a part
  FolderSequence& sequence_;
  SequenceInfo& info_;
  std::string camera_file_;
  std::optional<int> n_times_;  // lines of times.txt
  std::optional<double> depth_map_factor_;
  bool rate_is_assumed_ = false;  // neither the options nor the camera file define it
};

fs::path find_images(const fs::path& dir) {
  if (!fs::is_directory(dir)) fail("{}: no such folder", dir.string());
  for (const char* name : {"image_0", "image"}) {
    if (fs::is_directory(dir / name)) return dir / name;
  }
  fail(
      "{}: no folder image_0 or image in it: expected a VDO-SLAM folder with image_0, depth, flow and "
      "semantic",
      dir.string());
}

}  // namespace

void VdoFolderOptions::check() const {
  const auto not_negative = [](const char* name, double value) {
    check_option(std::isfinite(value) && value >= 0, name, value, "finite, 0 (from the folder) or larger");
  };
  not_negative("rate_hz", rate_hz);
  not_negative("fx", fx);
  not_negative("fy", fy);
  not_negative("cx", cx);
  not_negative("cy", cy);
  not_negative("bf", bf);
}

std::unique_ptr<Sequence> open_vdo_folder(const SourceSpec& source) {
  const auto options = options_of<VdoFolderOptions>(source);
  const fs::path dir = source.path;
  auto sequence = std::make_unique<FolderSequence>(source);
  SequenceInfo& info = sequence->info();
  info.sequence = source.sequence.empty()
                      ? fs::absolute(dir / "").lexically_normal().parent_path().filename().string()
                      : source.sequence;
  FolderFiles files{.left = find_images(dir).string()};
  sequence->choose_frames(files, dir.string());
  TextFiles texts(dir, sequence->image_frames(), *sequence);
  texts.read(options);
  files.depth = {.option = options.depth,
                 .kind = "disparity256",
                 .files = (dir / "depth").string(),
                 .provenance = fmt::format("depth: disparity png, bf = {:.7g}", info.camera.bf)};
  files.flow = {.option = options.flow,
                .kind = "flo",
                .files = (dir / "flow").string(),
                .provenance = "flow: precomputed .flo"};
  files.masks = {.option = options.masks,
                 .kind = "vdo_text",
                 .files = (dir / "semantic").string(),
                 .provenance = "masks: precomputed text"};
  // With the option `auto` this opens the source KIND:FILES of channel_source.cc, e.g.
  // disparity256:DIR/depth. FolderSequence::read() calls read() of these sources, and decodes the image
  // `left`: colours become the rounded luminance 0.299 R + 0.587 G + 0.114 B, gray images stay as they are.
  sequence->open_channels(files);
  texts.warn_about_depth_factor();
  return sequence;
}

namespace {

ObjectTruth read_object(const TextRows& rows) {
  ObjectTruth object;
  object.id = rows.integer(1, "the object id");
  if (object.id < 1)
    rows.fail_here("expected an object id of 1 or more (0 is the background), got {}", object.id);
  if (object.id > 65535) rows.fail_here("expected an object id of at most 65535, got {}", object.id);
  object.box = rows.box(2);
  const Eigen::Vector3d position(rows.metres(6, "x"), rows.metres(7, "y"), rows.metres(8, "z"));
  // KITTI's ry is 0 for an object that points along the camera's x axis; its own z axis points forwards.
  const double yaw = rows.radians(9, "ry") + std::numbers::pi / 2;
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()));
  object.T_camera_object = SE3(rotation, position);
  return object;
}

}  // namespace

ObjectTruths decode_vdo_objects(std::string_view text, const std::string& name) {
  ObjectTruths objects;
  for (TextRows rows(text, name); rows.next();) {
    rows.expect(10, "frame id left top right bottom x y z ry (10 values)");
    const int frame = rows.frame(0);
    const ObjectTruth object = read_object(rows);
    if (std::ranges::find(objects[frame], object.id, &ObjectTruth::id) != objects[frame].end()) {
      rows.fail_here("object {} appears twice in frame {}", object.id, frame);
    }
    objects[frame].push_back(object);
  }
  for (auto& [frame, list] : objects) std::ranges::sort(list, {}, &ObjectTruth::id);
  mark_interpolated(objects);
  return objects;
}

// ---- Writing the layout

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
    fail("sequence name '{}': expected one such as 0005, without any of the characters / \\ # @",
         request.sequence);
  }
  if (info.first_frame < 0 || info.last_frame > largest_frame) {
    fail("{} sequence {}: frames {}-{}: expected 0 to {}, which file names of six digits can store",
         info.dataset, info.sequence, info.first_frame, info.last_frame, largest_frame);
  }
  const fs::path final_folder = request.out / request.sequence;
  for (const char* name : {"image_0", "depth", "flow", "semantic", "pose_gt.txt"}) {
    if (fs::exists(final_folder / name)) {
      fail("{}: exists already: remove it, or choose another folder or sequence name",
           (final_folder / name).string());
    }
  }
  const fs::path folder = request.folder() / request.sequence;
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
