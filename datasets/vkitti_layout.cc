#include "sextant/datasets/vkitti_layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/vkitti1.h"

namespace sextant {

FolderFiles vkitti_files(const SequenceTruth& truth) {
  FolderFiles files{.width = vkitti_width, .height = vkitti_height};
  for (const auto& [frame, pose] : truth.camera.poses()) files.frames.insert(frame);
  if (!files.frames.empty()) return files;
  for (const auto& [frame, objects] : truth.objects) files.frames.insert(frame);
  return files;
}

void check_vkitti_frames(const Sequence& sequence, const std::string& root) {
  const SequenceInfo& info = sequence.info();
  const Trajectory& camera = sequence.truth().camera;
  if (camera.empty()) return;
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    if (camera.has(frame)) continue;
    fail(
        "{} {}: the extrinsics have no row of frame {}, of which there are files: take both from the same "
        "sequence, or choose other frames with @first-last",
        root, info.sequence, frame);
  }
}

VkittiName parse_vkitti1_name(const std::string& sequence) {
  const size_t slash = sequence.find('/');
  if (slash == std::string::npos) return {sequence, "clone"};
  return {sequence.substr(0, slash), sequence.substr(slash + 1)};
}

VkittiName parse_vkitti2_name(const std::string& sequence) {
  VkittiName name = parse_vkitti1_name(sequence);
  if (is_digits(name.group) && name.group.size() < 6)
    name.group = fmt::format("Scene{:02}", std::stoi(name.group));
  return name;
}

namespace {

constexpr int box_samples = 8;  // samples along each edge

std::string where(const Sequence& sequence, int frame) {
  return fmt::format("{}:{} frame {}", sequence.info().dataset, sequence.info().sequence, frame);
}

// Flow that ends beyond the outermost pixels of the image is invalid in the data set.
void drop_leaving(Image<Flow>& flow) {
  for (const auto [x, y] : pixels(flow)) {
    Flow& f = flow(x, y);
    const float u = static_cast<float>(x) + f.u;
    const float v = static_cast<float>(y) + f.v;
    const bool inside = u >= 0 && v >= 0 && u <= static_cast<float>(flow.width() - 1) &&
                        v <= static_cast<float>(flow.height() - 1);
    if (!inside) f = {};
  }
}

std::optional<bool> steps(const SequenceTruth& truth, int id, int from, int to) {
  const ObjectTruth* a = truth.find(from, id);
  const ObjectTruth* b = truth.find(to, id);
  const auto T_world_from = truth.camera.pose(from);
  const auto T_world_to = truth.camera.pose(to);
  if (a == nullptr || b == nullptr || !T_world_from || !T_world_to) return std::nullopt;
  const Eigen::Vector3d step =
      *T_world_to * b->T_camera_object.translation() - *T_world_from * a->T_camera_object.translation();
  return step.norm() >= moving_step_m;
}

void check_object(const std::string& where, const ObjectTruth& object) {
  if (!object.size_m) {
    fail("{}: object {} has no box size, which the layout needs: take a source whose truth has it", where,
         object.id);
  }
  if (object.type.find_first_of(" \t") != std::string::npos) {
    fail("{}: object {} has the type '{}': the layout needs one word", where, object.id, object.type);
  }
}

VkittiRow make_row(const Sequence& sequence, int frame, const ObjectTruth& object,
                   const MaskOutline& outline) {
  check_object(where(sequence, frame), object);
  VkittiRow row{.frame = frame,
                .track = object.id - 1,
                .object = &object,
                .angles = vkitti_angles(object.T_camera_object.rotation())};
  const Eigen::Vector3d& p = object.T_camera_object.translation();
  row.alpha_rad = std::remainder(row.angles.ry - std::atan2(p.x(), p.z()), 2 * std::numbers::pi);
  row.box = object.box.value_or(outline.box);
  row.n_pixels = outline.n_pixels;
  row.truncation = box_truncation(sequence.info(), object);
  const double area = (row.box.width() + 1) * (row.box.height() + 1);
  row.occupancy = area > 0 ? std::clamp(outline.n_pixels / area, 0.0, 1.0) : 0.0;
  row.moving = object.moving.value_or(moves(sequence.truth(), object.id, frame).value_or(false));
  row.type = object.type.empty() ? "Car" : object.type;
  return row;
}

/// Returns a frame with the true flow and depth, if the sequence has them, and without flow that leaves the
/// image.
Frame vkitti_frame(const Sequence& sequence, int frame, Channels channels) {
  auto flow = channels.flow ? sequence.true_flow(frame) : std::nullopt;
  auto depth = channels.depth ? sequence.true_depth(frame) : std::nullopt;
  if (flow) channels.flow = false;
  if (depth) channels.depth = false;
  Frame out = sequence.read(frame, channels);
  if (flow) out.flow = std::move(*flow);
  if (depth) out.depth_m = std::move(*depth);
  drop_leaving(out.flow);
  drop_leaving(out.backward_flow);
  return out;
}

}  // namespace

std::optional<bool> moves(const SequenceTruth& truth, int id, int frame) {
  const auto next = steps(truth, id, frame, frame + 1);
  return next ? next : steps(truth, id, frame - 1, frame);
}

double box_truncation(const SequenceInfo& info, const ObjectTruth& object) {
  const PinholeCamera& camera = info.camera.left;
  const auto in_view = [&](const Eigen::Vector3d& p) {
    if (p.z() <= 0) return false;
    const Eigen::Vector2d pixel = camera.project(p);
    return pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < info.width - 0.5 &&
           pixel.y() < info.height - 0.5;
  };
  int n_outside = 0;
  for (int i = 0; i < box_samples * box_samples * box_samples; ++i) {
    const Eigen::Array3d cell(i % box_samples, i / box_samples % box_samples, i / box_samples / box_samples);
    const Eigen::Array3d at = (cell + 0.5) / box_samples - Eigen::Array3d(0.5, 1.0, 0.5);
    n_outside += !in_view(object.T_camera_object * (at * object.size_m->array()).matrix());
  }
  return static_cast<double>(n_outside) / (box_samples * box_samples * box_samples);
}

std::vector<VkittiRow> vkitti_rows(const Sequence& sequence, const std::map<int, MaskOutlines>& outlines) {
  const SequenceInfo& info = sequence.info();
  std::vector<VkittiRow> rows;
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    const auto objects = sequence.truth().objects.find(frame);
    if (objects == sequence.truth().objects.end()) continue;
    const auto shown = outlines.find(frame);
    for (const ObjectTruth& object : objects->second) {
      const bool is_shown = shown != outlines.end() && shown->second.contains(object.id);
      if (!is_shown && !object.box) continue;
      rows.push_back(
          make_row(sequence, frame, object, is_shown ? shown->second.at(object.id) : MaskOutline{}));
    }
  }
  return rows;
}

std::map<int, MaskOutlines> write_vkitti_frames(const Sequence& sequence, const LayoutRequest& request,
                                                std::vector<LayoutFolder> folders) {
  std::map<int, MaskOutlines> outlines;
  const SequenceInfo& info = sequence.info();
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) outlines[frame];
  write_layout_frames(
      sequence, request,
      {.folders = std::move(folders),
       .read = [&](int frame, Channels channels) { return vkitti_frame(sequence, frame, channels); },
       .also = [&](const Frame& frame) { outlines.at(frame.index) = mask_outlines(frame.mask); }});
  return outlines;
}

void check_vkitti_poses(const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  const Trajectory& camera = sequence.truth().camera;
  if (camera.empty()) {
    if (sequence.truth().objects.empty()) return;
    fail("{}: it has true objects, but no true camera poses, which the layout needs",
         where(sequence, info.first_frame));
  }
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    if (!camera.has(frame)) {
      fail("{}: no true camera pose, although other frames have one: choose other frames with @first-last",
           where(sequence, frame));
    }
  }
}

namespace {

// Category of all pixels without a track, because sources do not distinguish roads from trees.
constexpr const char* static_category = "Misc";
constexpr Rgb static_color{80, 80, 80};

Rgb unpack(uint32_t n) {
  return {static_cast<uint8_t>(n >> 16), static_cast<uint8_t>(n >> 8), static_cast<uint8_t>(n)};
}

// Returns a distinct colour for every id: multiplication by an odd number is injective modulo 2^24.
Rgb color_of(int id) {
  if (id == 0) return static_color;
  constexpr uint32_t factor = 0x9E3779;
  constexpr uint32_t low_24_bits = 0xFFFFFF;
  const Rgb color = unpack(static_cast<uint32_t>(id) * factor & low_24_bits);
  return color == static_color ? unpack((static_cast<uint32_t>(id) + 65536) * factor & low_24_bits) : color;
}

Image<Rgb> scene_colors(const Image<uint16_t>& mask) {
  Image<Rgb> image(mask.width(), mask.height());
  std::transform(mask.data(), mask.data() + mask.size(), image.data(),
                 [](uint16_t id) { return color_of(id); });
  return image;
}

std::string color_table(const Sequence& sequence, const std::map<int, MaskOutlines>& outlines) {
  std::map<int, std::string> types;  // by id
  for (const auto& [frame, shown] : outlines) {
    for (const auto& [id, outline] : shown) types.emplace(id, "Car");
  }
  for (const auto& [frame, objects] : sequence.truth().objects) {
    for (const ObjectTruth& object : objects) {
      if (!object.type.empty()) types[object.id] = object.type;
    }
  }
  std::vector<Vkitti1Color> colors = {{static_category, std::nullopt, static_color}};
  for (const auto& [id, type] : types) colors.push_back({type, id - 1, color_of(id)});
  return encode_vkitti1_colors(colors);
}

Vkitti1Object to_text(const VkittiRow& row) {
  Vkitti1Object o;
  o.frame = row.frame;
  o.tid = row.track;
  o.label = o.orig_label = row.type;
  o.truncated = row.truncation >= 0.78 ? 2 : row.truncation > 0 ? 1 : 0;
  o.occluded = row.occupancy >= 0.75 ? 0 : row.occupancy >= 0.4 ? 1 : 2;
  o.alpha = row.alpha_rad;
  o.box = row.box;
  o.size_m = *row.object->size_m;
  o.position_m = row.object->T_camera_object.translation();
  o.angles = row.angles;
  o.truncr = row.truncation;
  o.occupr = row.occupancy;
  o.moving = row.moving;
  o.model = o.color = "unknown";
  return o;
}

class Vkitti1Writer {
 public:
  Vkitti1Writer(const Sequence& sequence, const LayoutRequest& request)
      : sequence_(sequence), info_(sequence.info()), request_(request) {
    const std::string name =
        request.sequence.empty() ? fmt::format("{:04}", default_number(info_.sequence)) : request.sequence;
    name_ = parse_vkitti1_name(name);
    check_name(name);
    check_camera();
    check_vkitti_poses(sequence);
  }

  std::string write() {
    const auto frames = [&](auto channel, auto image, const char* kind, const auto& encode) {
      return layout_folder(channel, image, folder(kind) / name_.group / name_.variation, "{:05}.png",
                           [=](const auto& pixels) { return encode_png(encode(pixels)); });
    };
    const auto as_it_is = [](const Image<Rgb>& image) { return image; };
    const auto outlines =
        write_vkitti_frames(sequence_, request_,
                            {frames(&Channels::rgb, &Frame::rgb, "rgb", as_it_is),
                             frames(&Channels::depth, &Frame::depth_m, "depthgt", cm_from_depth),
                             frames(&Channels::flow, &Frame::flow, "flowgt", vkitti_from_flow),
                             frames(&Channels::mask, &Frame::mask, "scenegt", scene_colors)});
    if (info_.channels.mask) {
      put("scenegt", stem() + "_scenegt_rgb_encoding.txt", color_table(sequence_, outlines));
    }
    write_truth(outlines);
    return fmt::format("vkitti1:{}#{}", request_.out.string(), name_.text());
  }

 private:
  std::string stem() const { return name_.group + "_" + name_.variation; }
  fs::path folder(const char* kind) const {
    const fs::path there =
        vkitti1_folder(request_.out, kind).value_or(request_.out / fmt::format("vkitti_1.3.1_{}", kind));
    return request_.stage.empty() ? there : request_.stage / there.lexically_relative(request_.out);
  }
  void put(const char* kind, const std::string& file, const std::string& bytes) const {
    write_file(folder(kind) / file, bytes);
  }

  void check_name(const std::string& name) const {
    if (name_.group.size() != 4 || !is_digits(name_.group) || name_.variation.empty() ||
        name_.variation.find('/') != std::string::npos) {
      fail("sequence '{}': expected four digits and a variation, such as 0018/clone", name);
    }
    if (!fs::is_directory(request_.out)) return;
    if (vkitti1_variations(request_.out, name_.group).contains(name_.variation)) {
      fail("{}: {} exists already: remove it, or choose another folder or sequence", request_.out.string(),
           name_.text());
    }
  }

  void check_camera() const {
    const PinholeCamera& k = info_.camera.left;
    if (k.fx == 725 && k.fy == 725 && k.cx == 620.5 && k.cy == 187 && info_.width == 1242 &&
        info_.height == 375) {
      return;
    }
    fail(
        "{}:{}: the layout vkitti1 cannot store a camera other than f = 725, c = (620.5, 187), 1242x375; "
        "this one has f = ({}, {}), c = ({}, {}), {}x{}: take the layout vkitti2",
        info_.dataset, info_.sequence, k.fx, k.fy, k.cx, k.cy, info_.width, info_.height);
  }

  void write_truth(const std::map<int, MaskOutlines>& outlines) const {
    const SequenceTruth& truth = sequence_.truth();
    if (truth.camera.empty()) return;
    std::map<int, SE3> T_camera_world;
    for (int frame = info_.first_frame; frame <= info_.last_frame; ++frame) {
      T_camera_world[frame] = truth.camera.pose(frame)->inverse();
    }
    fs::create_directories(folder("extrinsicsgt"));
    put("extrinsicsgt", stem() + ".txt", encode_vkitti1_extrinsics(T_camera_world));
    std::vector<Vkitti1Object> objects;
    for (const VkittiRow& row : vkitti_rows(sequence_, outlines)) objects.push_back(to_text(row));
    fs::create_directories(folder("motgt"));
    put("motgt", stem() + ".txt", encode_vkitti1_objects(objects));
  }

  const Sequence& sequence_;
  const SequenceInfo& info_;
  const LayoutRequest& request_;
  VkittiName name_;
};

}  // namespace

std::string write_vkitti1_layout(const Sequence& sequence, const LayoutRequest& request) {
  return Vkitti1Writer(sequence, request).write();
}

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

// Uses 8 bits if they are sufficient, as the data set does.
std::string encode_instances(const Image<uint16_t>& mask) {
  if (*std::max_element(mask.data(), mask.data() + mask.size()) > 255) return encode_png(mask);
  Image<uint8_t> narrow(mask.width(), mask.height());
  std::transform(mask.data(), mask.data() + mask.size(), narrow.data(),
                 [](uint16_t id) { return static_cast<uint8_t>(id); });
  return encode_png(narrow);
}

class Vkitti2Writer {
 public:
  Vkitti2Writer(const Sequence& sequence, const LayoutRequest& request)
      : sequence_(sequence), info_(sequence.info()), request_(request) {
    const std::string name =
        request.sequence.empty() ? std::to_string(default_number(info_.sequence)) : request.sequence;
    name_ = parse_vkitti2_name(name);
    if (!name_.group.starts_with("Scene") || name_.variation.empty() ||
        name_.variation.find('/') != std::string::npos) {
      fail("sequence '{}': expected a scene and a variation, such as Scene18/clone", name);
    }
    folder_ = request.folder() / name_.group / name_.variation;
    if (fs::exists(request.out / name_.group / name_.variation)) {
      fail("{}: {} exists already: remove it, or choose another folder or sequence", request.out.string(),
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
  return Vkitti2Writer(sequence, request).write();
}

}  // namespace sextant
