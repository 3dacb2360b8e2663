#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sextant/eval/check/conventions.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

// The limits are explained in docs/datasets.md.
constexpr double max_distance_m = 50;
constexpr double min_box_px = 12;
constexpr double nearest_m = 0.5;
constexpr double border_px = 3;
constexpr double min_overlap = 0.3;
constexpr double hidden_share = 0.1;
constexpr double box_quantile = 0.4;  // in the first frames of the demo half of the boxes are wrong
constexpr double full_share = 0.5;    // smallest share of its box that the mask of a fully visible car covers
constexpr double min_displacement_m = 1;
constexpr int max_steps = 5;
constexpr size_t min_mask_samples = 6;
constexpr double max_disparity_error_px =
    5;  // of the median over an object, from stereo matching or networks
const Eigen::Vector3d typical_car_m(1.7, 1.5, 4.2);  // width, height, length

/// Replaces a bad verdict of a check that assumes the size of a typical car by SUSPECT: other objects differ.
void allow_other_sizes(Finding& finding) {
  finding.sizes_assumed = true;
  finding.fail_limit = std::numeric_limits<double>::infinity();
  if (finding.passes() && finding.cause.empty()) {
    finding.message += ", for boxes of a typical car: sizes unknown";
    return;
  }
  finding.may_be_right = true;
  finding.message += fmt::format(
      "; the sizes are unknown, and a typical car of {} x {} x {} m is assumed: other objects, such as "
      "pedestrians, differ from it",
      typical_car_m.x(), typical_car_m.y(), typical_car_m.z());
}

std::optional<ImageBox> label_box(const ObjectTruth& object) {
  const bool large = object.box && object.box->width() >= min_box_px && object.box->height() >= min_box_px;
  return large ? object.box : std::nullopt;
}

bool cut_by_border(const ImageBox& box, const ConventionData& data) {
  return box.left < border_px || box.top < border_px || box.right > data.width - 1 - border_px ||
         box.bottom > data.height - 1 - border_px;
}

/// Returns true if a nearer object's box covers more than a tenth of this one, whose mask is then smaller.
bool hidden(const ObjectTruth& object, const ImageBox& box, const std::vector<ObjectTruth>& others) {
  return std::ranges::any_of(others, [&](const ObjectTruth& other) {
    if (other.id == object.id || !other.box) return false;
    if (other.T_camera_object.translation().z() >= object.T_camera_object.translation().z()) return false;
    return shared_area(box, *other.box) > hidden_share * box.width() * box.height();
  });
}

/// Calls body(frame, object) for every true object of the range.
template <typename Body>
void for_each_object(const ConventionData& data, Body body) {
  for (const auto& [frame, objects] : data.truth.objects) {
    if (!data.has(frame)) continue;
    for (const ObjectTruth& object : objects) body(frame, object);
  }
}

bool any_masks(const ConventionData& data) {
  return std::ranges::any_of(data.frames, [](const GridFrame& f) { return !f.mask.empty(); });
}

/// Returns the mask whose outline fits the box best; 0 if none fits.
int id_in_box(const GridFrame& frame, const ImageBox& box) {
  int best = 0;
  double most = min_overlap;
  for (const auto& [id, outline] : frame.outlines) {
    const auto& [left, top, right, bottom] = outline.box;  // of pixel centres
    const double o = overlap(box, {left - 0.5, top - 0.5, right + 0.5, bottom + 0.5});
    if (o > most) best = id, most = o;
  }
  return best;
}

/// Returns the bounding box of the eight projected corners; nullopt if one is not clearly in front of the
/// camera.
std::optional<ImageBox> projected_box(const PinholeCamera& camera, const ObjectTruth& object) {
  const Eigen::Vector3d size = object.size_m.value_or(typical_car_m);
  ImageBox box;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-1.0, 0.0}) {
      for (const double z : {-0.5, 0.5}) {
        const Eigen::Vector3d corner =
            object.T_camera_object * Eigen::Vector3d(x * size.x(), y * size.y(), z * size.z());
        if (corner.z() < nearest_m) return std::nullopt;
        const Eigen::Vector2d p = camera.project(corner);
        box.include(p.x(), p.y());
      }
    }
  }
  return box;
}

struct BoxOffsets {
  std::vector<double> sideways_m, upright_m;
  bool sizes_known = true;
  int n_boxes = 0;  ///< number of candidate label boxes
};

BoxOffsets box_offsets(const ConventionData& data) {
  BoxOffsets out;
  const PinholeCamera& camera = data.camera.left;
  for_each_object(data, [&](int /*frame*/, const ObjectTruth& object) {
    const auto label = label_box(object);
    if (!label || cut_by_border(*label, data)) return;
    ++out.n_boxes;
    out.sizes_known &= object.size_m.has_value();
    const double z = object.T_camera_object.translation().z();
    const auto box = projected_box(camera, object);
    if (z > max_distance_m && box) return;
    const double label_x = (label->left + label->right) / 2;
    // An object behind the camera cannot have a box: counts as a very large error instead of being left out.
    out.sideways_m.push_back(box ? ((box->left + box->right) / 2 - label_x) * z / camera.fx : 1e3);
    out.upright_m.push_back(box ? (box->bottom - label->bottom) * z / camera.fy : 1e3);
  });
  return out;
}

void judge_offsets(const BoxOffsets& offsets, const std::vector<double>& metres, Finding& finding) {
  if (!finding.measure(metres)) {
    finding.not_checkable(offsets.n_boxes == 0 ? "no 2-D boxes away from the image border"
                                               : "no box nearer than 50 m");
    return;
  }
  const double offset = *finding.value;
  finding.value = std::abs(offset);
  finding.message = fmt::format("offset {:+.2f} m", offset);
  if (offsets.sizes_known) return;
  finding.limit *= 2.5;
  allow_other_sizes(finding);
}

/// Returns the depth at which the ray through (u, v) enters the object's box; NaN if it misses the box.
double box_depth_m(const PinholeCamera& camera, const ObjectTruth& object, double u, double v) {
  const Eigen::Vector3d size = object.size_m.value_or(typical_car_m);
  const SE3 T_object_camera = object.T_camera_object.inverse();
  const Eigen::Vector3d origin = T_object_camera.translation();
  const Eigen::Vector3d ray = T_object_camera.rotation() * camera.ray(u, v);
  const Eigen::Vector3d low(-size.x() / 2, -size.y(), -size.z() / 2), high(size.x() / 2, 0, size.z() / 2);
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    double a = (low[axis] - origin[axis]) / ray[axis], b = (high[axis] - origin[axis]) / ray[axis];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a);
    leave = std::min(leave, b);
  }
  return enter < leave && enter > 0 ? enter : NAN;  // the ray has z = 1, so its parameter is the depth
}

/// Two tracks of which each box is fitted best by the mask with the id of the other in `frames`.
struct ExchangedIds {
  int one = 0, other = 0;
  std::vector<int> frames;
};

/// Returns the first two tracks that exchange their masks in two or more successive frames. A track that is
/// hidden by another one may be fitted best by its mask, but not the other way round at the same time.
std::optional<ExchangedIds> exchanged_ids(const ConventionData& data) {
  std::map<std::pair<int, int>, std::vector<int>> frames_of;
  for_each_object(data, [&](int frame, const ObjectTruth& object) {
    const auto mask_of = [&](const ObjectTruth& of) {
      const auto box = label_box(of);
      return box ? id_in_box(data.at(frame), *box) : 0;
    };
    const int id = mask_of(object);
    const ObjectTruth* const other = data.truth.find(frame, id);
    if (id > object.id && other != nullptr && mask_of(*other) == object.id)
      frames_of[{object.id, id}].push_back(frame);
  });
  for (const auto& [ids, frames] : frames_of) {
    const auto next = std::ranges::adjacent_find(frames, [](int a, int b) { return b == a + 1; });
    if (next != frames.end()) return ExchangedIds{ids.first, ids.second, frames};
  }
  return std::nullopt;
}

}  // namespace

Finding check_mask_ids(const ConventionData& data) {
  Finding finding{.check = "mask ids", .limit = 20, .fail_limit = 50, .unit = "%", .counted = "boxes"};
  if (!any_masks(data)) return finding.not_checkable("no masks");
  if (data.truth.objects.empty()) return finding.not_checkable("no true objects");
  int wrong = 0, boxes = 0, empty = 0;
  for_each_object(data, [&](int frame, const ObjectTruth& object) {
    const auto box = label_box(object);
    if (!box || data.at(frame).mask.empty() || data.at(frame).outlines.empty()) return;
    ++boxes;
    const int id = id_in_box(data.at(frame), *box);
    empty += id == 0 ? 1 : 0;
    wrong += id != 0 && id != object.id ? 1 : 0;
  });
  finding.n = boxes - empty;
  if (boxes == 0) return finding.not_checkable("no true 2-D boxes in frames with masks of objects");
  if (finding.n == 0) {
    finding.n = boxes;
    finding.value = 100;
    finding.message = "no mask fits any true box";
    return finding;
  }
  finding.value = 100.0 * wrong / finding.n;
  if (empty > 0) finding.message = fmt::format("{} more boxes have no mask that fits", empty);
  const auto exchanged = finding.fails() ? std::nullopt : exchanged_ids(data);
  if (!exchanged) return finding;
  finding.value = 100;
  finding.cause = fmt::format("ids {} and {} are exchanged between masks and truth from frame {} on",
                              exchanged->one, exchanged->other, exchanged->frames.front());
  finding.message = fmt::format("in frames {}", frame_list(exchanged->frames));
  return finding;
}

Finding check_mask_boxes(const ConventionData& data) {
  Finding finding{.check = "mask boxes", .limit = 15, .fail_limit = 40, .unit = "%", .counted = "boxes"};
  constexpr double rounding_px = 1;
  std::vector<double> shares, beyond_rounding_px;
  for_each_object(data, [&](int frame, const ObjectTruth& object) {
    const auto box = label_box(object);
    const auto& outlines = data.at(frame).outlines;
    const auto found = outlines.find(object.id);
    if (!box || found == outlines.end()) return;
    const auto& [mask, n_pixels] = found->second;
    // A mask may lack occluded parts, but must not exceed the box.
    const bool may_lack =
        n_pixels < full_share * box->area() || hidden(object, *box, data.truth.objects.at(frame));
    const auto off = [&](double outwards) { return may_lack ? std::max(outwards, 0.0) : std::abs(outwards); };
    const double x = std::max(off(std::max(box->left, 0.0) - mask.left),
                              off(mask.right - std::min(box->right, data.width - 1.0)));
    const double y = std::max(off(std::max(box->top, 0.0) - mask.top),
                              off(mask.bottom - std::min(box->bottom, data.height - 1.0)));
    shares.push_back(100 * std::max(x / box->width(), y / box->height()));
    beyond_rounding_px.push_back(std::max(x, y) - rounding_px);
  });
  if (!finding.measure(shares)) {
    return finding.not_checkable(any_masks(data) ? "no true 2-D box has a mask of its id" : "no masks");
  }
  finding.value = quantile(shares, box_quantile);
  finding.sharp = quantile(beyond_rounding_px, box_quantile) > 0;
  return finding;
}

Finding check_box_sideways(const ConventionData& data) {
  Finding finding{
      .check = "box sideways", .limit = 0.15, .fail_limit = 0.35, .unit = "m", .counted = "boxes"};
  const BoxOffsets offsets = box_offsets(data);
  judge_offsets(offsets, offsets.sideways_m, finding);
  if (finding.passes() && offsets.sizes_known && *finding.value > 0.04 && *finding.value < 0.09 &&
      finding.n >= 20) {
    finding.message += ": as between KITTI's cameras 0 and 2 (0.06 m), harmless";
  }
  return finding;
}

Finding check_box_upright(const ConventionData& data) {
  Finding finding{.check = "box upright", .limit = 0.25, .fail_limit = 0.5, .unit = "m", .counted = "boxes"};
  const BoxOffsets offsets = box_offsets(data);
  judge_offsets(offsets, offsets.upright_m, finding);
  return finding;
}

Finding check_object_depth(const ConventionData& data) {
  Finding finding{.check = "object depth", .limit = 12, .fail_limit = 20, .unit = "%", .counted = "objects"};
  const PinholeCamera& camera = data.camera.left;
  const auto percent_off = [](double ratio) { return std::min(100 * std::abs(ratio - 1), 1e6); };
  // Farther objects may exceed the limit because of errors of disparity.
  const double near_m = data.camera.bf / max_disparity_error_px * finding.fail_limit / 100;
  std::vector<double> ratios;
  std::map<int, std::vector<double>> percent_of_near;
  bool sizes_known = true;
  for_each_object(data, [&](int frame, const ObjectTruth& object) {
    const GridFrame& grid = data.at(frame);
    if (grid.depth_m.empty() || grid.depth_m.width() != grid.mask.width()) return;
    if (object.T_camera_object.translation().norm() > max_distance_m) return;
    if (!grid.outlines.contains(object.id)) return;
    std::vector<double> given, expected;
    for (const auto [i, j] : pixels(grid.mask)) {
      if (grid.mask(i, j) != object.id || !std::isfinite(grid.depth_m(i, j))) continue;
      const double z = box_depth_m(camera, object, data.pixel(i), data.pixel(j));
      given.push_back(grid.depth_m(i, j));
      if (std::isfinite(z)) expected.push_back(z);
    }
    if (given.size() < min_mask_samples) return;
    sizes_known &= object.size_m.has_value();
    // If the mask misses the box completely, the depth of the box's centre is used.
    const double z =
        expected.size() < min_mask_samples / 2 ? object.T_camera_object.translation().z() : median(expected);
    ratios.push_back(median(given) / std::max(z, 1e-3));
    if (median(given) < near_m) percent_of_near[object.id].push_back(percent_off(ratios.back()));
  });
  if (!finding.measure(ratios)) return finding.not_checkable("no mask of a true object with depth");
  const double ratio = *finding.value;
  finding.value = percent_off(ratio);
  finding.message = fmt::format("depth is {:.4g} of that of the true box", ratio);
  if (sizes_known) {
    find_wrong_objects(percent_of_near, finding.fail_limit, finding);
    return finding;
  }
  finding.limit *= 1.8;
  find_wrong_objects(percent_of_near, 1.8 * finding.fail_limit, finding);
  if (!finding.cause.empty()) finding.cause = "only some objects are wrong, or they are no cars";
  allow_other_sizes(finding);
  return finding;
}

namespace {

/// Returns the poses of an object in the world in `frame` and the frames after it, max_steps at most, as long
/// as it and the camera have true poses.
std::vector<SE3> next_poses(const ConventionData& data, int frame, int id) {
  std::vector<SE3> poses;
  for (int at = frame; at <= std::min(frame + max_steps, data.last_frame()); ++at) {
    const ObjectTruth* const object = data.truth.find(at, id);
    const auto T_world_camera = data.truth.camera.pose(at);
    if (object == nullptr || !T_world_camera) break;
    poses.push_back(*T_world_camera * object->T_camera_object);
  }
  return poses;
}

/// Returns the first of the poses that is min_displacement_m away from poses[0]. Returns poses.size() if
/// there is none, or if the body jumps there: the way is longer than three times as many median steps.
size_t end_of_way(const std::vector<SE3>& poses) {
  std::vector<double> steps_m;
  for (size_t i = 1; i < poses.size(); ++i)
    steps_m.push_back((poses[i].translation() - poses[i - 1].translation()).norm());
  for (size_t i = 1; i < poses.size(); ++i) {
    const double way_m = (poses[i].translation() - poses[0].translation()).norm();
    if (way_m < min_displacement_m) continue;
    return way_m > 3 * static_cast<double>(i) * median(steps_m) ? poses.size() : i;
  }
  return poses.size();
}

/// Replaces the verdict on the headings by SUSPECT if fewer than two objects contradict their way, because a
/// single object may rightly do so.
void allow_a_single_object(const std::map<int, std::vector<double>>& angles_of, Finding& finding) {
  std::vector<int> contradict;
  for (const auto& [id, angles] : angles_of) {
    if (median(angles) > finding.fail_limit) contradict.push_back(id);
  }
  if (contradict.size() > 1) return;
  finding.fail_limit = std::numeric_limits<double>::infinity();
  if (contradict.empty()) return;
  finding.message =
      fmt::format("object {} alone contradicts its way: right if it drives backwards, or slides sideways",
                  contradict.front());
}

}  // namespace

Finding check_heading(const ConventionData& data) {
  Finding finding{.check = "heading", .limit = 15, .fail_limit = 30, .unit = "deg", .counted = "steps"};
  if (data.truth.objects.empty()) return finding.not_checkable("no true objects");
  if (data.truth.camera.poses().size() < 2) return finding.not_checkable("no true camera poses");
  std::vector<double> angles;
  std::map<int, std::vector<double>> angles_of;
  for_each_object(data, [&](int frame, const ObjectTruth& object) {
    const std::vector<SE3> poses = next_poses(data, frame, object.id);
    const size_t end = end_of_way(poses);
    if (end >= poses.size()) return;
    const Eigen::Vector3d way = poses[end].translation() - poses[0].translation();
    const Eigen::Vector3d ahead =
        poses[0].rotation() * Eigen::Vector3d::UnitZ() + poses[end].rotation() * Eigen::Vector3d::UnitZ();
    angles.push_back(std::atan2(way.cross(ahead).norm(), way.dot(ahead)) * 180 / std::numbers::pi);
    angles_of[object.id].push_back(angles.back());
  });
  if (!finding.measure(angles)) finding.not_checkable("no object moves by 1 m within 5 frames");
  if (finding.fails()) allow_a_single_object(angles_of, finding);
  if (finding.checkable() && !finding.passes()) finding.cause = cause_in_equal_poses(data);
  return finding;
}

Finding check_moving_flags(const ConventionData& data) {
  constexpr double rests_m = 0.01, moves_m = 0.1;
  Finding finding{.check = "moving flags", .limit = 20, .fail_limit = 50, .unit = "%", .counted = "flags"};
  int n_rest = 0, n_move = 0;
  for_each_object(data, [&](int frame, const ObjectTruth& object) {
    const ObjectTruth* const next = data.truth.find(frame + 1, object.id);
    const auto T_world_a = data.truth.camera.pose(frame), T_world_b = data.truth.camera.pose(frame + 1);
    if (!object.moving || next == nullptr || !T_world_a || !T_world_b) return;
    const double step_m =
        (*T_world_a * object.T_camera_object.translation() - *T_world_b * next->T_camera_object.translation())
            .norm();
    ++finding.n;
    n_rest += *object.moving && step_m < rests_m ? 1 : 0;
    n_move += !*object.moving && step_m > moves_m ? 1 : 0;
  });
  if (finding.n == 0) return finding.not_checkable("no object with a flag and a pose in the next frame");
  finding.value = 100.0 * (n_rest + n_move) / finding.n;
  if (finding.passes()) return finding;
  finding.cause = "the flags of moving and of resting objects are exchanged, or of another sequence";
  finding.message =
      fmt::format("{} flagged as moving rest, {} flagged as resting move by more than 0.1 m", n_rest, n_move);
  return finding;
}

}  // namespace sextant
