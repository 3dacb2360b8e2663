#include "sextant/eval/check/conventions.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "sextant/geometry/object_motion.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

// The limits are explained in docs/datasets.md.
constexpr double moves_m = 0.1;
constexpr double moving_flow_px = 1;
constexpr double never = 1e9;  // the check is never FAIL, only SUSPECT

/// Returns the distance of a ratio from 1 as a power of `factor`.
double factors_off(double ratio, double factor) {
  return ratio > 0 && std::isfinite(ratio) ? std::abs(std::log(ratio)) / std::log(factor) : 100;
}

bool same(const SE3& a, const SE3& b) {
  return a.translation() == b.translation() && a.rotation().coeffs() == b.rotation().coeffs();
}

bool moves(const Trajectory& camera, int prev, int curr) {
  const auto motion = camera.motion(prev, curr);
  return motion && motion->translation().norm() > moves_m;
}

}  // namespace

bool flow_shows_motion(const GridFrame& frame) {
  std::vector<double> lengths;
  for (size_t i = 0; i < frame.flow.size(); ++i) {
    const Flow& flow = frame.flow.data()[i];
    const bool background = frame.mask.size() != frame.flow.size() || frame.mask.data()[i] == 0;
    if (flow.valid() && background) lengths.push_back(std::hypot(double{flow.u}, double{flow.v}));
  }
  return !lengths.empty() && median(lengths) > moving_flow_px;
}

std::string cause_in_equal_poses(const ConventionData& data) {
  const std::map<int, SE3>& poses = data.truth.camera.poses();
  if (poses.size() < 2) return "";
  const SE3& first = poses.begin()->second;
  if (!std::ranges::all_of(poses, [&](const auto& entry) { return same(entry.second, first); })) return "";
  const auto with_flow = std::ranges::count_if(data.frames, [](const auto& f) { return !f.flow.empty(); });
  if (2 * std::ranges::count_if(data.frames, flow_shows_motion) <= with_flow) return "";
  return fmt::format("all camera poses are {}, although the camera moves: missing truth?",
                     same(first, SE3()) ? "the identity" : "equal");
}

void find_wrong_parts(const CheckedParts& checked, Finding& finding) {
  constexpr double contrast = 5;
  const std::vector<CheckedPart>& parts = checked.parts;
  std::vector<double> all, wrong;
  std::vector<int> numbers;
  for (const CheckedPart& part : parts) all.push_back(part.value);
  for (size_t i = 0; i < parts.size() && parts.size() > 1; ++i) {
    std::vector<double> others = all;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    if (parts[i].value <= std::max(parts[i].fail_limit, contrast * median(others))) continue;
    wrong.push_back(parts[i].value);
    numbers.push_back(parts[i].number);
  }
  if (wrong.empty()) return;
  finding.cause = checked.cause;
  finding.value = median(wrong);
  finding.message =
      fmt::format("in {} of {} {} {}; the median over all {} is {} {}: {}", wrong.size(), parts.size(),
                  checked.kind, frame_list(numbers), checked.kind.substr(0, checked.kind.find(',')),
                  value_text(median(all)), finding.unit, checked.advice);
}

void find_wrong_objects(const std::map<int, std::vector<double>>& values, double fail_limit,
                        Finding& finding) {
  constexpr size_t least_values = 3;
  if (finding.fails()) return;
  CheckedParts objects{{}, "objects, of ids", "only some objects are wrong", "check their poses and ids"};
  for (const auto& [id, of_object] : values) {
    if (of_object.size() >= least_values) objects.parts.push_back({id, median(of_object), fail_limit});
  }
  find_wrong_parts(objects, finding);
}

std::string value_text(double value) {
  return value > largest_shown ? fmt::format("> {:g}", largest_shown) : fmt::format("{:.3f}", value);
}

std::string frame_list(const std::vector<int>& frames) {
  constexpr size_t shown = 10;
  const auto last = frames.begin() + static_cast<std::ptrdiff_t>(std::min(shown, frames.size()));
  return fmt::format("{}{}", fmt::join(frames.begin(), last, ", "), frames.size() > shown ? ", .." : "");
}

Finding check_camera_model(const ConventionData& data) {
  Finding finding{
      .check = "camera model", .limit = 1, .fail_limit = 2.5, .unit = "x limit", .n = 1, .counted = "camera"};
  const PinholeCamera& camera = data.camera.left;
  if (data.width <= 0 || data.height <= 0) {
    finding.n = 0;
    return finding.not_checkable("the image size is unknown");
  }
  const double w = data.width, h = data.height;
  const std::pair<double, std::string> deviations[] = {
      {std::abs(camera.cx - (w - 1) / 2) / (0.2 * w), fmt::format("cx = {:.1f} px of {:.0f}", camera.cx, w)},
      {std::abs(camera.cy - (h - 1) / 2) / (0.2 * h), fmt::format("cy = {:.1f} px of {:.0f}", camera.cy, h)},
      {factors_off(camera.fx / camera.fy, 1.1), fmt::format("fx / fy = {:.3f}", camera.fx / camera.fy)},
      {factors_off(camera.fx / w, 4), fmt::format("fx = {:.1f} px for a width of {:.0f}", camera.fx, w)},
      {data.camera.bf > 0 ? factors_off(data.camera.bf / camera.fx / 0.3, 8) : 0,
       fmt::format("a baseline of {:.3g} m (bf / fx)", data.camera.bf / camera.fx)}};
  const auto& worst = *std::ranges::max_element(deviations, {}, &std::pair<double, std::string>::first);
  finding.value = worst.first;
  finding.message = "the most unusual number: " + worst.second;
  return finding;
}

Finding check_camera_path(const ConventionData& data) {
  Finding finding{
      .check = "camera path", .limit = 45, .fail_limit = never, .unit = "deg", .counted = "steps"};
  std::vector<double> angles;
  for (int frame = data.first_frame; frame < data.last_frame(); ++frame) {
    if (!moves(data.truth.camera, frame, frame + 1)) continue;
    const Eigen::Vector3d t = data.truth.camera.motion(frame, frame + 1)->translation();
    angles.push_back(std::atan2(std::hypot(t.x(), t.y()), t.z()) * 180 / std::numbers::pi);
  }
  if (!finding.measure(angles)) {
    return finding.not_checkable(data.truth.camera.empty() ? "no true camera poses"
                                                           : "the camera stands still");
  }
  if (*finding.value > finding.limit) {
    finding.message =
        "the camera does not move along its z axis (right for a camera that looks sideways or back)";
  }
  return finding;
}

Finding check_repeated_poses(const ConventionData& data) {
  Finding finding{.check = "repeated poses", .unit = "steps", .counted = "steps"};
  int repeated = 0, identities = 0;
  const Trajectory& camera = data.truth.camera;
  for (int frame = data.first_frame + 1; frame <= data.last_frame(); ++frame) {
    const auto before = camera.pose(frame - 1), now = camera.pose(frame);
    if (!before || !now) continue;
    ++finding.n;
    if (same(*now, SE3()) && moves(camera, frame - 1, frame)) ++identities;
    const bool neighbours = moves(camera, frame - 2, frame - 1) && moves(camera, frame, frame + 1);
    if (same(*before, *now) && (neighbours || flow_shows_motion(data.at(frame - 1)))) ++repeated;
  }
  int objects = 0, repeated_objects = 0;
  for (const auto& [frame, list] : data.truth.objects) {
    if (!data.has(frame)) continue;
    for (const ObjectTruth& object : list) {
      objects += same(object.T_camera_object, SE3()) ? 1 : 0;
      const ObjectTruth* const before = data.truth.find(frame - 1, object.id);
      const bool repeats = before != nullptr && same(before->T_camera_object, object.T_camera_object) &&
                           !same(object.T_camera_object, SE3());
      repeated_objects += repeats && moves(camera, frame - 1, frame) ? 1 : 0;
    }
  }
  if (finding.n == 0 && objects == 0) {
    return finding.not_checkable("no true poses in successive frames");
  }
  finding.value = repeated + identities + objects + repeated_objects;
  if (repeated > 0)
    finding.message =
        fmt::format("the pose of {} frames repeats the one before although the camera moves; ", repeated);
  if (identities > 0)
    finding.message += fmt::format("{} camera poses are exactly the identity; ", identities);
  if (objects > 0) finding.message += fmt::format("{} object poses are exactly the identity; ", objects);
  if (repeated_objects > 0)
    finding.message +=
        fmt::format("{} object poses equal the ones before in camera coordinates although the camera moves; ",
                    repeated_objects);
  if (repeated + identities + objects > 0)
    finding.message += "was missing truth written as the identity, or as the last pose?";
  if (repeated > 0) finding.cause = cause_in_equal_poses(data);
  if (repeated_objects > 0 && *finding.value == repeated_objects)
    finding.cause = "object poses repeat the ones before: the last pose in place of missing truth?";
  return finding;
}

namespace {

/// Position in the world by frame, m.
using Path = std::map<int, Eigen::Vector3d>;

Path camera_path(const ConventionData& data) {
  Path path;
  for (int frame = data.first_frame; frame <= data.last_frame(); ++frame) {
    if (const auto pose = data.truth.camera.pose(frame)) path[frame] = pose->translation();
  }
  return path;
}

std::map<int, Path> object_paths(const ConventionData& data) {
  std::map<int, Path> paths;
  for (const auto& [frame, list] : data.truth.objects) {
    const auto camera = data.truth.camera.pose(frame);
    if (!camera || !data.has(frame)) continue;
    for (const ObjectTruth& object : list)
      paths[object.id][frame] = *camera * object.T_camera_object.translation();
  }
  return paths;
}

/// Returns where a body would be in `frame` at the velocity of the step before, if its last two positions are
/// known.
std::optional<Eigen::Vector3d> predicted(const Path& path, int frame) {
  const auto last = path.find(frame - 1), before = path.find(frame - 2);
  if (last == path.end() || before == path.end()) return std::nullopt;
  return 2 * last->second - before->second;
}

struct Jump {
  int frame = 0;
  double distance_m = 0;  ///< from the predicted position
  Eigen::Vector3d place = {0, 0, 0};
};

/// Returns the first of the largest jumps of a path, and counts the positions that were compared. The place
/// after a jump differs from its prediction as well, by about as much.
Jump largest_jump(const Path& path, int& n) {
  std::vector<Jump> jumps;
  double largest_m = 0;
  for (const auto& [frame, place] : path) {
    const auto expected = predicted(path, frame);
    if (!expected) continue;
    jumps.push_back({frame, (place - *expected).norm(), place});
    largest_m = std::max(largest_m, jumps.back().distance_m);
  }
  n += static_cast<int>(jumps.size());
  const auto first =
      std::ranges::find_if(jumps, [&](const Jump& j) { return 2 * j.distance_m >= largest_m; });
  return first == jumps.end() ? Jump{} : *first;
}

std::vector<double> speeds_kmh(const Path& path, double rate_hz) {
  std::vector<double> speeds;
  for (const auto& [frame, place] : path) {
    const auto before = path.find(frame - 1);
    if (before != path.end()) speeds.push_back((place - before->second).norm() * rate_hz * kmh_per_mps);
  }
  return speeds;
}

}  // namespace

Finding check_jumps(const ConventionData& data) {
  constexpr double least_m = 1, change_mps = 30, near_share = 0.3;
  Finding finding{.check = "jumps", .fail_limit = never, .unit = "m", .counted = "poses"};
  finding.limit = std::max(least_m, change_mps / data.rate_hz);
  const Jump of_camera = largest_jump(camera_path(data), finding.n);
  const std::map<int, Path> paths = object_paths(data);
  int who = -1;
  Jump jump;
  for (const auto& [id, path] : paths) {
    const Jump own = largest_jump(path, finding.n);
    if (own.distance_m > jump.distance_m) std::tie(who, jump) = std::pair(id, own);
  }
  if (finding.n == 0) return finding.not_checkable("no true poses in three successive frames");
  const bool camera_jumps = of_camera.distance_m > finding.limit;  // the objects jump with it
  finding.value = camera_jumps ? of_camera.distance_m : std::max(of_camera.distance_m, jump.distance_m);
  if (finding.passes()) return finding;
  if (camera_jumps) {
    finding.message = fmt::format("the camera jumps at frame {}", of_camera.frame);
    return finding;
  }
  finding.message = fmt::format("object {} jumps at frame {}", who, jump.frame);
  for (const auto& [id, path] : paths) {
    const auto place = predicted(path, jump.frame);
    if (id != who && place && (jump.place - *place).norm() < near_share * jump.distance_m)
      finding.cause =
          fmt::format("object {} takes the place of object {} at frame {}: are ids exchanged there?", who, id,
                      jump.frame);
  }
  return finding;
}

Finding check_speed(const ConventionData& data) {
  Finding finding{.check = "speed", .limit = 250, .fail_limit = 1000, .unit = "km/h", .counted = "bodies"};
  const std::vector<double> ego = speeds_kmh(camera_path(data), data.rate_hz);
  if (ego.empty()) return finding.not_checkable("no true camera poses in successive frames");
  double fastest = median(ego);
  std::string who = "the camera";
  finding.n = 1;
  for (const auto& [id, path] : object_paths(data)) {
    const std::vector<double> speeds = speeds_kmh(path, data.rate_hz);
    finding.n += !speeds.empty();
    if (speeds.size() < 3 || median(speeds) <= fastest) continue;
    fastest = median(speeds);
    who = fmt::format("object {}", id);
  }
  finding.value = fastest;
  finding.message = fmt::format("fastest: {}, at {:g} Hz", who, data.rate_hz);
  return finding;
}

Finding check_times(const ConventionData& data) {
  Finding finding{.check = "times", .limit = 50, .fail_limit = never, .unit = "%", .counted = "stamps"};
  std::vector<double> steps;
  for (auto it = data.times_s.begin(); it != data.times_s.end(); ++it) {
    if (!data.has(it->first)) continue;
    ++finding.n;
    const auto next = std::next(it);
    if (next == data.times_s.end() || next->first != it->first + 1 || !data.has(next->first)) continue;
    steps.push_back(next->second - it->second);
  }
  if (steps.empty()) return finding.not_checkable("no time stamps of successive frames");
  const double typical = median(steps);
  if (*std::ranges::min_element(steps) <= 0 || typical <= 0) {
    finding.value = 100;
    finding.fail_limit = finding.limit;
    finding.cause = "time stamps do not increase";
    return finding;
  }
  double worst = 0;
  for (const double step : steps) worst = std::max(worst, 100 * std::abs(step / typical - 1));
  finding.value = worst;
  if (worst > finding.limit)
    finding.message = "uneven steps: are frames missing, or time stamps of another sensor?";
  if (std::abs(typical * data.rate_hz - 1) > 0.01) {
    finding.message += fmt::format("{}steps of {:.4g} s, but the rate in use is {:g} Hz",
                                   finding.message.empty() ? "" : "; ", typical, data.rate_hz);
  }
  return finding;
}

namespace {

constexpr double samples_per_frame = 5000;

}  // namespace

ConventionData make_convention_data(const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  ConventionData data{.camera = info.camera,
                      .width = info.width,
                      .height = info.height,
                      .rate_hz = info.rate_hz,
                      .first_frame = info.first_frame};
  data.frames.resize(static_cast<size_t>(info.last_frame - info.first_frame + 1));
  const double area = static_cast<double>(info.width) * info.height;
  data.step = std::max(1, static_cast<int>(std::lround(std::sqrt(area / samples_per_frame))));
  data.depth_kind = info.depth_kind;
  data.truth = sequence.truth();
  data.floor = info.floor;
  data.times_s = info.times_s;
  return data;
}

std::vector<FlowSample> flow_samples(const ConventionData& data, int k) {
  const int from = k + data.flow_from, to = k + data.flow_to;
  if (!data.has(k) || !data.has(from) || !data.has(to)) return {};
  const Image<Flow>& flow = data.at(k).flow;
  const Image<float>& depth = data.at(from).depth_m;
  const Image<uint16_t>& mask = data.at(from).mask;
  if (flow.empty() || depth.width() != flow.width() || depth.height() != flow.height()) return {};
  const bool masked = mask.width() == flow.width() && mask.height() == flow.height();
  std::vector<FlowSample> samples;
  samples.reserve(flow.size());
  for (const auto [i, j] : pixels(flow)) {
    const float z = depth(i, j);
    if (!flow(i, j).valid() || !std::isfinite(z) || z <= 0) continue;
    samples.push_back({data.pixel(i), data.pixel(j), z, flow(i, j), masked ? mask(i, j) : 0});
  }
  return samples;
}

CheckOutcome Finding::outcome() const {
  if (!checkable()) return CheckOutcome::note;
  if (passes()) return CheckOutcome::pass;
  return fails() ? CheckOutcome::fail : CheckOutcome::suspect;
}

bool Finding::measure(const std::vector<double>& values) {
  n = static_cast<int>(values.size());
  if (!values.empty()) value = median(values);
  return !values.empty();
}

const Finding& Finding::not_checkable(std::string_view why) {
  message = fmt::format("not checkable: {}", why);
  return *this;
}

double Finding::ratio() const {
  if (!checkable()) return 0;
  if (limit > 0) return *value / limit;
  return *value > 0 ? 1 + *value : 0;
}

std::vector<Finding> check_conventions(const ConventionData& data) {
  const Finding flow = check_static_flow(data), scale = check_depth_scale(data);
  Finding order = check_depth_order(data);
  if (flow.passes() && scale.passes()) allow_depth_order(order);
  return {flow,
          scale,
          order,
          check_image_flow(data),
          check_object_flow(data),
          check_object_depth(data),
          check_mask_ids(data),
          check_mask_boxes(data),
          check_box_sideways(data),
          check_box_upright(data),
          check_heading(data),
          check_moving_flags(data),
          check_camera_model(data),
          check_camera_path(data),
          check_repeated_poses(data),
          check_jumps(data),
          check_speed(data),
          check_times(data)};
}

}  // namespace sextant
