#include "sextant/eval/profile/error_fields.h"

#include <cmath>
#include <numbers>

#include "sextant/datasets/channels/computed_channels.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/estimator/registry.h"
#include "sextant/estimator/start/robust_start.h"

namespace sextant {
namespace {

constexpr float nearest_m = 3, farthest_m = 40;
constexpr int grid_px = 6;  // spacing of the points for the motion if there is no image

bool is_background(const Frame& frame, int x, int y) {
  const float z = frame.depth_m(x, y);
  return z >= nearest_m && z <= farthest_m && (frame.mask.empty() || frame.mask(x, y) == 0);
}

/// Returns corners, where flow is well defined; if there is no image, the points of a grid.
std::vector<Feature> points_of(const Frame& frame) {
  const int width = frame.flow.width(), height = frame.flow.height();
  const ExtractionOptions options;
  if (frame.gray.width() == width && frame.gray.height() == height)
    return strongest_per_cell(fast_corners(frame.gray, options.fast_threshold), width, height, options);
  std::vector<Feature> grid;
  for (int y = grid_px / 2; y < height; y += grid_px) {
    for (int x = grid_px / 2; x < width; x += grid_px) grid.push_back({x, y, 0});
  }
  return grid;
}

/// Returns the camera motion fitted to the measured flow and depth of the background; nullopt for fewer than
/// 50 points, and if they do not determine a motion.
std::optional<SE3> fitted_motion(const Frame& frame, const StereoCamera& camera) {
  Problem problem{camera, {}, std::nullopt};
  for (const auto& [x, y, response] : points_of(frame)) {
    const Flow flow = frame.flow(x, y);
    if (flow.valid() && is_background(frame, x, y))
      problem.points.push_back(x, y, frame.depth_m(x, y), flow.u, flow.v);
  }
  if (problem.points.size() < 50) return std::nullopt;
  const RobustStart start = robust_start(problem, std::nullopt, {});
  if (start.status != Status::ok) return std::nullopt;
  const MotionEstimate estimate =
      make_estimator("joint_flow_depth", {{"covariance", "independent"}})->estimate(problem, start.point);
  if (estimate.status != Status::ok) return std::nullopt;
  return estimate.T_curr_prev;
}

/// Returns the point at (x, y) in next camera coordinates; nullopt if it does not belong to the background,
/// or if its depth there is 0.5 m or less.
std::optional<Eigen::Vector3d> moved(const Frame& frame, const StereoCamera& camera, const SE3& T, int x,
                                     int y) {
  if (!is_background(frame, x, y)) return std::nullopt;
  const Eigen::Vector3d p = T * camera.left.backproject(x, y, frame.depth_m(x, y));
  return p.z() > 0.5 ? std::optional(p) : std::nullopt;
}

Image<Flow> induced_flow(const Frame& frame, const StereoCamera& camera, const SE3& T) {
  Image<Flow> out(frame.flow.width(), frame.flow.height());
  for (const auto [x, y] : pixels(out)) {
    if (const auto p = moved(frame, camera, T, x, y)) {
      const Eigen::Vector2d at = camera.left.project(*p);
      out(x, y) = {static_cast<float>(at.x() - x), static_cast<float>(at.y() - y)};
    }
  }
  return out;
}

/// Returns the disparity at (x, y): that of the nearest pixel, corrected for the remaining offset by the
/// slope of the plane through its 3 x 3 pixels. Errors that are independent between pixels keep 1.03
/// times their variance, whereas linear interpolation would average them to 4/9 of it. NaN without these
/// pixels, and if the four pixels around (x, y) differ by more than 1 px, because they then belong to
/// several surfaces.
double disparity_at(const Image<float>& depth_m, double bf, double x, double y) {
  const int column = static_cast<int>(std::lround(x)), row = static_cast<int>(std::lround(y));
  if (!depth_m.contains(column - 1, row - 1) || !depth_m.contains(column + 1, row + 1)) return NAN;
  const double right = x - column, down = y - row;
  double lowest = INFINITY, highest = -INFINITY, slope_x = 0, slope_y = 0;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const double d = bf / depth_m(column + i, row + j);
      if (!std::isfinite(d)) return NAN;
      slope_x += i * d / 6;
      slope_y += j * d / 6;
      const bool surrounds = (i == 0 || (i > 0) == (right > 0)) && (j == 0 || (j > 0) == (down > 0));
      if (surrounds) lowest = std::min(lowest, d), highest = std::max(highest, d);
    }
  }
  return highest - lowest <= 1 ? bf / depth_m(column, row) + slope_x * right + slope_y * down : NAN;
}

Image<float> against_next_frame(const Frame& frame, const Image<float>& next_depth_m,
                                const StereoCamera& camera, const SE3& T) {
  Image<float> out(frame.depth_m.width(), frame.depth_m.height(), NAN);
  for (const auto [x, y] : pixels(out)) {
    const auto p = moved(frame, camera, T, x, y);
    if (!p) continue;
    const Eigen::Vector2d at = camera.left.project(*p);
    const double there = disparity_at(next_depth_m, camera.bf, at.x(), at.y());
    out(x, y) = static_cast<float>((there - camera.bf / p->z()) / std::numbers::sqrt2);
  }
  return out;
}

template <typename T>
Image<T> mirrored(const Image<T>& image) {
  return image_of(image.width(), image.height(),
                  [&](int x, int y) { return image(image.width() - 1 - x, y); });
}

Image<float> against_right(const Frame& frame, double bf) {
  const Image<uint8_t> right = rgb_to_gray(frame.rgb_right);
  const Image<float> of_right = mirrored(sgbm_disparity(mirrored(right), mirrored(frame.gray)));
  Image<float> out(frame.depth_m.width(), frame.depth_m.height(), NAN);
  for (const auto [x, y] : pixels(out)) {
    const double d = bf / frame.depth_m(x, y);
    if (!std::isfinite(d)) continue;
    const int there = static_cast<int>(std::lround(x - d));
    if (!of_right.contains(there, y)) continue;
    out(x, y) = static_cast<float>((d - of_right(there, y)) / std::numbers::sqrt2);
  }
  return out;
}

Image<float> disparity_errors(const Image<float>& depth_m, const Image<float>& truth_m, double bf) {
  Image<float> out(depth_m.width(), depth_m.height(), NAN);
  for (size_t i = 0; i < out.size(); ++i) {
    const double error = bf / depth_m.data()[i] - bf / truth_m.data()[i];
    if (std::isfinite(error)) out.data()[i] = static_cast<float>(error);
  }
  return out;
}

/// Returns the errors of u and of v; NaN where either flow is invalid.
std::vector<Image<float>> flow_errors(const Image<Flow>& flow, const Image<Flow>& truth) {
  std::vector<Image<float>> out(2, Image<float>(flow.width(), flow.height(), NAN));
  for (size_t i = 0; i < flow.size(); ++i) {
    const Flow a = flow.data()[i], b = truth.data()[i];
    if (!a.valid() || !b.valid()) continue;
    out[0].data()[i] = a.u - b.u;
    out[1].data()[i] = a.v - b.v;
  }
  return out;
}

}  // namespace

ErrorSource::ErrorSource(const Sequence& sequence, Noise noise, uint64_t seed, DepthReference depth)
    : sequence_(sequence),
      noise_(std::move(noise)),
      draws_(seed, sequence.info().dataset, sequence.info().sequence) {
  const SequenceInfo& info = sequence.info();
  const Channels& has = info.channels;
  const Json added = noise_.options();
  const bool flow_noise = added.contains("flow") || added.contains("outliers");
  const bool depth_noise = added.contains("depth") || added.contains("quantisation");
  const bool can_induce = has.flow && has.depth && info.camera.bf > 0 && info.last_frame > info.first_frame;
  if (has.flow) {
    if (info.exact.flow ? flow_noise : sequence.true_flow(info.first_frame).has_value())
      flow_ = FlowReference::given;
    else if (!info.exact.flow && can_induce)
      flow_ = FlowReference::induced;
  }
  if (has.depth && info.camera.bf > 0) {
    if (info.exact.depth ? depth_noise : sequence.true_depth(info.first_frame).has_value())
      depth_ = DepthReference::given;
    else if (!info.exact.depth && can_induce)
      depth_ = DepthReference::next_frame;
  }
  if (depth == DepthReference::left_right && !(has.depth && has.rgb_right && has.gray))
    fail("depth reference left_right: the source needs depth and the images of both cameras");
  if (depth != DepthReference::none && depth != DepthReference::given) depth_ = depth;
  if (flow_ == FlowReference::none && depth_ == DepthReference::none) {
    fail("flow and depth have no reference from which their errors can be measured: {}",
         info.exact.flow || info.exact.depth
             ? "they are the ground truth itself, and no noise is added: give --noise"
             : "expected flow and depth of at least two frames, or a data set with dense truth");
  }
}

Frame ErrorSource::measured(int frame, Channels channels) const {
  Frame out = sequence_.read(frame, channels);
  if (noise_.none()) return out;
  return noise_.apply(std::move(out), sequence_.info().camera, draws_).frame;
}

Image<Flow> ErrorSource::given_flow(int frame) const {
  if (sequence_.info().exact.flow) return sequence_.read(frame, {.flow = true}).flow;
  return sequence_.true_flow(frame).value_or(Image<Flow>());
}

Image<float> ErrorSource::given_depth(int frame) const {
  if (sequence_.info().exact.depth) return sequence_.read(frame, {.depth = true}).depth_m;
  return sequence_.true_depth(frame).value_or(Image<float>());
}

std::optional<ErrorFields> ErrorSource::read(int frame) const {
  const SequenceInfo& info = sequence_.info();
  const bool left_right = depth_ == DepthReference::left_right;
  const bool moves = flow_ == FlowReference::induced || depth_ == DepthReference::next_frame;
  Frame now = measured(frame, {.gray = left_right || (moves && info.channels.gray),
                               .rgb_right = left_right,
                               .depth = info.channels.depth,
                               .flow = info.channels.flow,
                               .mask = info.channels.mask});
  ErrorFields out;
  std::optional<SE3> T;
  if (moves && frame < info.last_frame && !now.flow.empty()) T = fitted_motion(now, info.camera);
  if (flow_ == FlowReference::given && !now.flow.empty()) {
    const Image<Flow> truth = given_flow(frame);
    if (!truth.empty()) out.flow_px = flow_errors(now.flow, truth);
  }
  if (flow_ == FlowReference::induced && T)
    out.flow_px = flow_errors(now.flow, induced_flow(now, info.camera, *T));
  if (depth_ == DepthReference::given) {
    const Image<float> truth = given_depth(frame);
    if (!truth.empty()) out.disparity_px = {disparity_errors(now.depth_m, truth, info.camera.bf)};
  }
  if (depth_ == DepthReference::next_frame && T)
    out.disparity_px = {
        against_next_frame(now, measured(frame + 1, {.depth = true}).depth_m, info.camera, *T)};
  if (left_right) out.disparity_px = {against_right(now, info.camera.bf)};
  if (out.flow_px.empty() && out.disparity_px.empty()) return std::nullopt;
  if (!now.flow.empty()) {
    const auto length_px = [&](int x, int y) { return std::hypot(now.flow(x, y).u, now.flow(x, y).v); };
    out.properties.push_back({"flow_px", image_of(now.flow.width(), now.flow.height(), length_px)});
  }
  if (!now.depth_m.empty()) out.properties.push_back({"depth_m", std::move(now.depth_m)});
  if (!now.mask.empty()) out.properties.push_back({"border_px", border_distance(now.mask)});
  return out;
}

}  // namespace sextant
