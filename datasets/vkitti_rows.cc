#include "sextant/datasets/vkitti_rows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sextant {
namespace {

constexpr int box_samples = 8;  // along each edge

std::string where(const Sequence& sequence, int frame) {
  return fmt::format("{}:{} frame {}", sequence.info().dataset, sequence.info().sequence, frame);
}

// What points beyond the image's outermost pixels is no measurement in the data set.
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

/// What a layout can hold of a frame.
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

}  // namespace sextant
