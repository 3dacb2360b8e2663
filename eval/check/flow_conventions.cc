#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sextant/eval/check/conventions.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

// The limits are explained in docs/datasets.md.
constexpr double still_px = 0.5;          // pairs with a smaller median flow are not used
constexpr double static_floor_px = 0.75;  // residual of a good flow network
constexpr double static_share = 0.25;     // share of the parallax
constexpr double static_fail_factor = 1.6;
constexpr size_t truth_points = 500;  // enough to determine the effect of the truth's accuracy on a pair
constexpr double scale_limit_percent = 3;
constexpr double scale_fail_percent = 6;
constexpr double object_limit_m = 0.3;
constexpr double object_fail_m = 0.6;
constexpr double min_parallax_px = 1;
constexpr int min_points_of_pair = 50;
constexpr int min_points_of_object = 8;
constexpr double far_off_px = 1e6;    // flow of a point that is behind the camera after the motion
constexpr double step_jitter = 0.05;  // relative scatter of the steps computed from stereo depth and flow

double length(const Flow& flow) { return std::hypot(double{flow.u}, double{flow.v}); }

/// Returns the flow of a point that moves by T_to_from; far_off_px if it ends behind the camera.
Eigen::Vector2d predicted_flow(const PinholeCamera& camera, const FlowSample& s, const SE3& T_to_from) {
  const Eigen::Vector3d p = T_to_from * camera.backproject(s.u, s.v, s.z_m);
  if (p.z() <= 0.01) return Eigen::Vector2d::Constant(far_off_px);
  return camera.project(p) - Eigen::Vector2d(s.u, s.v);
}

double residual_px(const PinholeCamera& camera, const FlowSample& s, const SE3& T_to_from) {
  const Eigen::Vector2d r = predicted_flow(camera, s, T_to_from) - Eigen::Vector2d(s.flow.u, s.flow.v);
  const double length = r.norm();
  return std::isfinite(length) ? std::min(length, far_off_px) : far_off_px;
}

/// Returns the smallest value up to which the weights sum to at least half of the total; by bisection,
/// without sorting.
double weighted_median(std::vector<std::pair<double, double>> value_and_weight) {
  double half = 0;
  for (const auto& [value, weight] : value_and_weight) half += weight / 2;
  auto begin = value_and_weight.begin(), end = value_and_weight.end();
  while (end - begin > 1) {
    const auto middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end);
    double below = 0;
    for (auto it = begin; it != middle; ++it) below += it->second;
    if (below >= half) {
      end = middle;
    } else {
      half -= below;
      begin = middle;
    }
  }
  return begin == end ? NAN : begin->first;
}

/// The background of a flow image and its true motion.
struct StaticPair {
  int frame = 0;  ///< from which the flow goes
  SE3 T_to_from;
  std::vector<FlowSample> points;
};

/// Returns the background and the true motion of each flow image that has truth and enough points.
std::vector<StaticPair> static_pairs(const ConventionData& data) {
  std::vector<StaticPair> pairs;
  for (int k = data.first_frame; k <= data.last_frame(); ++k) {
    const auto motion = data.truth.background_motion(k + data.flow_from, k + data.flow_to);
    if (!motion) continue;
    StaticPair pair{k + data.flow_from, *motion, flow_samples(data, k)};
    std::erase_if(pair.points, [](const FlowSample& s) { return s.id != 0; });
    if (static_cast<int>(pair.points.size()) >= min_points_of_pair) pairs.push_back(std::move(pair));
  }
  return pairs;
}

/// Returns the likely error of the rotations of true steps: the geometric mean of the lower and the upper
/// bound of dataset.h, or the one that is known.
std::optional<double> likely_rotation_error_deg(const TruthFloor& floor) {
  if (!floor.rotation_deg || !floor.rotation_timing_deg)
    return floor.rotation_deg ? floor.rotation_deg : floor.rotation_timing_deg;
  return std::sqrt(*floor.rotation_deg * *floor.rotation_timing_deg);
}

/// Returns motions that are as likely true as that of the pair: each differs from it by one standard error of
/// the truth (datasets/dataset.h), along the path, sideways, or about one axis of the camera. Empty if the
/// data set does not know the accuracy of its truth.
std::vector<SE3> likely_motions(const ConventionData& data, const SE3& T_to_from) {
  std::vector<Vector6d> errors;
  const auto add = [&](const Eigen::Vector3d& shift_m, const Eigen::Vector3d& turn_rad) {
    errors.emplace_back();
    errors.back() << shift_m, turn_rad;
  };
  const Eigen::Vector3d none = Eigen::Vector3d::Zero(), way = T_to_from.translation();
  const TruthFloor& floor = data.floor;
  if (const auto along_m = data.truth.camera_step_floor_m; along_m && way.norm() > 0) {
    add(*along_m * way.normalized(), none);
  }
  if (const Eigen::Vector3d side = Eigen::Vector3d::UnitY().cross(way); floor.lateral_m && side.norm() > 0) {
    add(*floor.lateral_m * side.normalized(), none);
  }
  if (const auto rotation_deg = likely_rotation_error_deg(floor)) {
    // Shares of the axes: pitch, yaw and roll of a car are rotations about the camera's x, y and z axis.
    Eigen::Vector3d shares = Eigen::Vector3d::Ones();
    if (floor.gyro_deg)
      shares = Eigen::Vector3d(floor.gyro_deg->y(), floor.gyro_deg->z(), floor.gyro_deg->x());
    const Eigen::Vector3d axis_rad = *rotation_deg * std::numbers::pi / 180 * shares.normalized();
    for (int axis = 0; axis < 3; ++axis) add(none, axis_rad[axis] * Eigen::Vector3d::Unit(axis));
  }
  std::vector<SE3> motions;
  for (const Vector6d& error : errors) motions.push_back(SE3::exp(error) * T_to_from);
  return motions;
}

/// Calls use(point, predicted flow, its change) for the points of the pair, once for each equally likely
/// motion, and end() after each of these.
template <typename Use, typename End>
void for_each_likely_change(const ConventionData& data, const StaticPair& pair, const Use& use,
                            const End& end) {
  const size_t stride = pair.points.size() / truth_points + 1;
  for (const SE3& motion : likely_motions(data, pair.T_to_from)) {
    for (size_t i = 0; i < pair.points.size(); i += stride) {
      const FlowSample& s = pair.points[i];
      const Eigen::Vector2d predicted = predicted_flow(data.camera.left, s, pair.T_to_from);
      const Eigen::Vector2d change = predicted_flow(data.camera.left, s, motion) - predicted;
      if (change.norm() < far_off_px / 2) use(s, predicted, change);
    }
    end();
  }
}

/// Returns the median change of the predicted flow of the pair's points within the accuracy of the truth, px.
double truth_error_px(const ConventionData& data, const StaticPair& pair) {
  double squares = 0;
  std::vector<double> changes;
  for_each_likely_change(
      data, pair,
      [&](const FlowSample&, const Eigen::Vector2d&, const Eigen::Vector2d& change) {
        changes.push_back(change.norm());
      },
      [&] {
        if (!changes.empty()) squares += std::pow(median(changes), 2);
        changes.clear();
      });
  return std::sqrt(squares);
}

/// Returns why there is nothing to compare; `otherwise` if all inputs exist.
std::string nothing_to_compare(const ConventionData& data, bool poses, bool objects,
                               const std::string& otherwise) {
  const auto any = [&](auto channel) {
    return std::ranges::any_of(data.frames, [&](const GridFrame& f) { return !(f.*channel).empty(); });
  };
  if (!any(&GridFrame::flow)) return "no flow";
  if (!any(&GridFrame::depth_m)) return "no depth";
  if (poses && data.truth.camera.poses().size() < 2) return "no true camera poses";
  if (objects && data.truth.objects.empty()) return "no true objects";
  if (objects && !any(&GridFrame::mask)) return "no masks";
  return otherwise;
}

/// The largest residual that the median of a pair, or of all pairs, may have, px.
double static_limit(double parallax_px, double truth_error_px) {
  return std::hypot(std::max(static_floor_px, parallax_px < far_off_px ? static_share * parallax_px : 0),
                    truth_error_px);
}

/// Returns the step length computed from flow and depth, as a share of the true one; NaN without parallax.
/// The weights are the parallax, so that near points dominate. Parallax is proportional to step / depth only
/// to first order, which a few iterations correct.
double step_share(const PinholeCamera& camera, const StaticPair& pair) {
  const SE3 rotation(pair.T_to_from.rotation(), Eigen::Vector3d::Zero());
  double share = 1;
  for (int round = 0; round < 8; ++round) {
    std::vector<std::pair<double, double>> weighted;
    for (FlowSample sample : pair.points) {
      sample.z_m /= share;
      const Eigen::Vector2d turned = predicted_flow(camera, sample, rotation);
      const Eigen::Vector2d expected = predicted_flow(camera, sample, pair.T_to_from) - turned;
      const Eigen::Vector2d given = Eigen::Vector2d(sample.flow.u, sample.flow.v) - turned;
      if (!(expected.norm() >= min_parallax_px && expected.norm() < far_off_px / 2)) continue;
      weighted.emplace_back(given.dot(expected) / expected.squaredNorm(), given.norm());
    }
    if (static_cast<int>(weighted.size()) < min_points_of_pair) return NAN;
    const double step = weighted_median(std::move(weighted));
    if (!(step > 0.05 && step < 20)) return NAN;
    share *= step;
    if (std::abs(step - 1) < 1e-9) break;
  }
  return share;
}

/// Returns the first-order variance of step_share() from the accuracy of the truth.
double truth_variance(const ConventionData& data, const StaticPair& pair) {
  const SE3 rotation(pair.T_to_from.rotation(), Eigen::Vector3d::Zero());
  double variance = 0;
  std::vector<std::pair<double, double>> weighted;
  for_each_likely_change(
      data, pair,
      [&](const FlowSample& s, const Eigen::Vector2d& predicted, const Eigen::Vector2d& change) {
        const Eigen::Vector2d expected = predicted - predicted_flow(data.camera.left, s, rotation);
        const double length = expected.norm();
        if (!(length >= min_parallax_px && length < far_off_px / 2)) return;
        weighted.emplace_back(change.dot(expected) / (length * length), length);
      },
      [&] {
        if (!weighted.empty()) variance += std::pow(weighted_median(weighted), 2);
        weighted.clear();
      });
  return variance;
}

}  // namespace

Finding check_static_flow(const ConventionData& data) {
  Finding finding{.check = "static flow", .unit = "px", .counted = "points", .sharp = true};
  const PinholeCamera& camera = data.camera.left;
  std::vector<double> residuals, parallax, truth_errors;
  std::vector<CheckedPart> pairs;
  const std::vector<StaticPair> seen = static_pairs(data);
  for (const StaticPair& pair : seen) {
    const SE3 rotation(pair.T_to_from.rotation(), Eigen::Vector3d::Zero());
    std::vector<double> r, given, without_rotation, truth;
    for (const FlowSample& s : pair.points) {
      r.push_back(residual_px(camera, s, pair.T_to_from));
      given.push_back(length(s.flow));
      truth.push_back(predicted_flow(camera, s, pair.T_to_from).norm());
      without_rotation.push_back(residual_px(camera, s, rotation));
    }
    if (median(given) < still_px && median(truth) < still_px) continue;
    residuals.insert(residuals.end(), r.begin(), r.end());
    parallax.insert(parallax.end(), without_rotation.begin(), without_rotation.end());
    truth_errors.push_back(truth_error_px(data, pair));
    pairs.push_back({pair.frame, median(r),
                     static_fail_factor * static_limit(median(without_rotation), truth_errors.back())});
  }
  if (!finding.measure(residuals)) {
    return finding.not_checkable(nothing_to_compare(
        data, true, false,
        !seen.empty() ? "the camera stands still" : "too few background points with depth and flow"));
  }
  finding.limit = static_limit(median(parallax), median(truth_errors));
  finding.fail_limit = static_fail_factor * finding.limit;
  find_wrong_parts(
      {pairs, "pairs, of frames", "only some frames are wrong", "check their flow, depth and poses"},
      finding);
  if (!finding.passes() && finding.cause.empty()) finding.cause = cause_in_equal_poses(data);
  return finding;
}

std::optional<DeviatingShare> deviating_share(const ConventionData& data) {
  constexpr double tolerance_px = 0.25;
  DeviatingShare share;
  int n_off = 0;
  for (const StaticPair& pair : static_pairs(data)) {
    std::vector<double> given;
    int off = 0;
    for (const FlowSample& s : pair.points) {
      given.push_back(length(s.flow));
      off += residual_px(data.camera.left, s, pair.T_to_from) > tolerance_px ? 1 : 0;
    }
    if (median(given) < still_px) continue;
    share.n += static_cast<int>(given.size());
    n_off += off;
  }
  if (share.n == 0) return std::nullopt;
  share.percent = 100.0 * n_off / share.n;
  return share;
}

std::optional<DeviatingShare> empty_flow_share(const ConventionData& data) {
  constexpr double moving_px = 1;
  DeviatingShare share;
  int n_empty = 0;
  for (int k = data.first_frame; k <= data.last_frame(); ++k) {
    const Image<Flow>& flow = data.at(k).flow;
    const int from = k + data.flow_from;
    if (flow.empty() || !data.has(from)) continue;
    const auto motion = data.truth.background_motion(from, k + data.flow_to);
    const Image<float>& depth = data.at(from).depth_m;
    const Image<uint16_t>& mask = data.at(from).mask;
    const bool has_depth = depth.size() == flow.size(), has_mask = mask.size() == flow.size();
    std::vector<double> others;
    std::vector<std::pair<int, int>> empty;
    for (const auto [i, j] : pixels(flow)) {
      if (!flow(i, j).valid() || (has_mask && mask(i, j) != 0)) continue;
      ++share.n;
      if (length(flow(i, j)) > 0) {
        others.push_back(length(flow(i, j)));
      } else {
        empty.emplace_back(i, j);
      }
    }
    if (others.empty()) continue;
    const bool others_move = median(others) > moving_px;
    for (const auto& [i, j] : empty) {
      if (!motion || !has_depth) {
        n_empty += others_move ? 1 : 0;
      } else if (std::isfinite(depth(i, j)) && depth(i, j) > 0) {
        const FlowSample sample{data.pixel(i), data.pixel(j), depth(i, j), flow(i, j), 0};
        n_empty += residual_px(data.camera.left, sample, *motion) > moving_px ? 1 : 0;
      }
    }
  }
  if (share.n == 0) return std::nullopt;
  share.percent = 100.0 * n_empty / share.n;
  return share;
}

DepthFactor fit_depth_factor(const ConventionData& data) {
  DepthFactor fit;
  double length_m = 0, shown_m = 0, sum = 0, squares = 0, truth = 0;
  for (const StaticPair& pair : static_pairs(data)) {
    const double share = step_share(data.camera.left, pair);
    if (!std::isfinite(share)) continue;
    ++fit.n;
    length_m += pair.T_to_from.translation().norm();
    shown_m += share * pair.T_to_from.translation().norm();
    sum += share;
    squares += share * share;
    truth += truth_variance(data, pair);
  }
  if (fit.n == 0) return fit;
  // Few pairs do not determine the scatter of the steps: step_jitter and the accuracy of the truth are used
  // as a prior with the weight of two pairs.
  const double n = fit.n, mean = sum / n;
  const double spread = std::max(0.0, squares - n * mean * mean);
  const double assumed = step_jitter * step_jitter + truth / n;
  fit.error = std::sqrt((spread + 2 * assumed) / (n + 1) / n);
  fit.factor = length_m / shown_m;
  return fit;
}

std::optional<double> range_share(const ConventionData& data) {
  const PinholeCamera& camera = data.camera.left;
  const auto ray = [&](const FlowSample& s) { return camera.ray(s.u, s.v).norm(); };
  double share = 0, expected = 0;
  int n = 0;
  for (const StaticPair& pair : static_pairs(data)) {
    std::vector<double> rays;
    for (const FlowSample& s : pair.points) rays.push_back(ray(s));
    const double middle = median(rays);
    StaticPair inner{pair.frame, pair.T_to_from, {}}, outer = inner;
    std::vector<double> inner_rays, outer_rays;
    for (const FlowSample& s : pair.points) {
      (ray(s) < middle ? inner : outer).points.push_back(s);
      (ray(s) < middle ? inner_rays : outer_rays).push_back(ray(s));
    }
    const double inner_step = step_share(camera, inner), outer_step = step_share(camera, outer);
    if (!std::isfinite(inner_step) || !std::isfinite(outer_step)) continue;
    // A depth that is too large leads to steps that are too large.
    share += std::log(outer_step / inner_step);
    expected += std::log(median(outer_rays) / median(inner_rays));
    ++n;
  }
  if (n == 0 || expected <= 0) return std::nullopt;
  return share / expected;
}

Finding check_depth_scale(const ConventionData& data) {
  Finding finding{.check = "depth scale", .unit = "%", .counted = "pairs"};
  const DepthFactor fit = fit_depth_factor(data);
  finding.n = fit.n;
  if (finding.n == 0) {
    return finding.not_checkable(
        nothing_to_compare(data, true, false, "no pair with parallax that depth explains"));
  }
  finding.value = 100 * std::abs(fit.factor - 1);
  finding.limit = scale_limit_percent + 200 * fit.error;
  finding.fail_limit = std::max(finding.limit, scale_fail_percent + 100 * fit.error);
  finding.message = fmt::format("depth x {:.4f} agrees best with flow and poses", fit.factor);
  return finding;
}

Finding check_object_flow(const ConventionData& data) {
  Finding finding{.check = "object flow",
                  .limit = object_limit_m,
                  .fail_limit = object_fail_m,
                  .unit = "m",
                  .counted = "objects",
                  .sharp = true};
  const PinholeCamera& camera = data.camera.left;
  std::vector<double> residuals;
  std::map<int, std::vector<double>> residuals_of;
  for (int k = data.first_frame; k <= data.last_frame(); ++k) {
    std::map<int, std::vector<FlowSample>> by_id;
    for (const FlowSample& s : flow_samples(data, k)) {
      if (s.id != 0) by_id[s.id].push_back(s);
    }
    for (const auto& [id, samples] : by_id) {
      const auto motion = data.truth.object_motion(id, k + data.flow_from, k + data.flow_to);
      if (!motion || static_cast<int>(samples.size()) < min_points_of_object) continue;
      std::vector<double> metres;
      for (const FlowSample& s : samples)
        metres.push_back(residual_px(camera, s, *motion) * s.z_m / camera.fx);
      residuals.push_back(median(metres));
      residuals_of[id].push_back(residuals.back());
    }
  }
  if (!finding.measure(residuals)) {
    finding.not_checkable(nothing_to_compare(data, false, true, "no mask of a true object in two frames"));
  }
  find_wrong_objects(residuals_of, finding.fail_limit, finding);
  return finding;
}

Finding check_depth_order(const ConventionData& data) {
  Finding finding{.check = "depth order", .limit = 1, .fail_limit = 1.5, .unit = "x", .counted = "frames"};
  std::vector<double> ratios;
  for (const GridFrame& frame : data.frames) {
    const Image<float>& depth = frame.depth_m;
    std::vector<double> low, mid;
    for (int j = 0; j < depth.height(); ++j) {
      const double y = (j + 0.5) / depth.height();
      for (int i = 0; i < depth.width(); ++i) {
        if (!std::isfinite(depth(i, j))) continue;
        if (y > 0.8) low.push_back(depth(i, j));
        if (y > 0.4 && y < 0.65) mid.push_back(depth(i, j));
      }
    }
    if (low.size() > 10 && mid.size() > 10) ratios.push_back(median(low) / median(mid));
  }
  if (!finding.measure(ratios)) return finding.not_checkable("no depth");
  if (*finding.value > 1) {
    finding.message = "depth grows towards the bottom of the image: is it disparity, or upside down?";
  }
  return finding;
}

void allow_depth_order(Finding& order) {
  if (!order.checkable() || order.passes()) return;
  order.fail_limit = std::numeric_limits<double>::infinity();
  order.may_be_right = true;
  order.message =
      "depth grows towards the bottom of the image, but agrees with flow and true poses: right for a camera "
      "that looks at a ceiling, or at a near object in front of a farther floor";
}

}  // namespace sextant
