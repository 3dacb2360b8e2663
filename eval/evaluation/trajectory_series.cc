#include "sextant/eval/evaluation/trajectory_series.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

#include "sextant/eval/evaluation/trajectory_matching.h"
#include "sextant/eval/evaluation/trajectory_offset.h"

namespace sextant {
namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
constexpr double gap_steps = 10;

/// Returns the angle that differs from `angle` by full turns and is nearest to `other`.
double nearest_turn(double other, double angle) { return angle + 360 * std::round((other - angle) / 360); }

/// Roll, pitch and yaw, each in [-180, 180].
Eigen::Vector3d angles_deg(const Eigen::Matrix3d& R, const ViewAxes& axes) {
  const int v = axes.out, c = (v + 1) % 3, b = (v + 2) % 3;
  constexpr double to_deg = 180 / std::numbers::pi;
  return to_deg * Eigen::Vector3d(std::atan2(R(v, b), R(v, v)), -std::asin(std::clamp(R(v, c), -1.0, 1.0)),
                                  std::atan2(R(b, c), R(c, c)));
}

std::vector<bool> begins_of(const std::vector<double>& time) {
  std::vector<bool> begins(time.size(), false);
  if (time.empty()) return begins;
  begins.front() = true;
  if (time.size() < 2) return begins;
  const double longest = gap_steps * median_step(time);
  for (size_t i = 1; i < time.size(); ++i) begins[i] = time[i] - time[i - 1] > longest;
  return begins;
}

std::vector<double> step_speeds(const TrajectoryCurve& curve) {
  std::vector<double> speed(curve.size(), no_number);
  for (size_t i = 1; i < curve.size(); ++i) {
    const double dt = curve.time[i] - curve.time[i - 1];
    if (!curve.begins[i] && dt > 0) speed[i] = (curve.position_m[i] - curve.position_m[i - 1]).norm() / dt;
  }
  return speed;
}

TrajectoryCurve curve_of_reference(const PoseSeries& poses, double begin_s, const ViewAxes& axes) {
  TrajectoryCurve curve;
  curve.name = "reference";
  curve.time = times_of(poses);
  for (double& t : curve.time) t -= begin_s;
  curve.frame = frames_of(poses);
  curve.position_m = poses.positions_m;
  curve.path_m = path_lengths_m(poses);
  for (size_t i = 0; i < poses.size() && poses.has_rotations(); ++i) {
    Eigen::Vector3d angles = angles_deg(poses.rotations[i], axes);
    for (int k = 0; k < 3 && i > 0; ++k) angles[k] = nearest_turn(curve.angles_deg.back()[k], angles[k]);
    curve.angles_deg.push_back(angles);
  }
  curve.begins = begins_of(curve.time);
  curve.speed = step_speeds(curve);
  return curve;
}

/// Returns the requested error at each pose; the largest one if several pairs end at it.
std::vector<double> errors_by_pose(const EgoResult& run) {
  std::vector<double> errors(run.estimate.size(), no_number);
  for (size_t i = 0; i < run.errors.size(); ++i) {
    double& error = errors[run.pairs.empty() ? i : static_cast<size_t>(run.pairs[i].second)];
    error = std::isnan(error) ? run.errors[i] : std::max(error, run.errors[i]);
  }
  return errors;
}

TrajectoryCurve curve_of_run(const EgoResult& run, const TrajectoryCurve& reference, const EgoCurves& curves,
                             double begin_s) {
  TrajectoryCurve curve;
  curve.name = run.name;
  curve.position_m = run.estimate.positions_m;
  curve.error = errors_by_pose(run);
  for (size_t i = 0; i < run.estimate.size(); ++i) {
    const auto row = static_cast<size_t>(run.reference_rows[i]);
    curve.time.push_back(run.reference.stamps_s.empty() || !curves.has_time
                             ? reference.time[row]
                             : run.reference.stamps_s[i] - begin_s);
    curve.frame.push_back(reference.frame[row]);
    curve.path_m.push_back(reference.path_m[row]);
    curve.position_error_m.emplace_back(run.estimate.positions_m[i] - run.reference.positions_m[i]);
    if (!run.has_rotations()) continue;
    Eigen::Vector3d angles = angles_deg(run.estimate.rotations[i], curves.axes);
    const Eigen::Vector3d of_reference = angles_deg(run.reference.rotations[i], curves.axes);
    Eigen::Vector3d error;
    for (int k = 0; k < 3; ++k) {
      error[k] = nearest_turn(0, angles[k] - of_reference[k]);
      angles[k] = nearest_turn(reference.angles_deg[row][k], angles[k]);
    }
    curve.angles_deg.push_back(angles);
    curve.angle_error_deg.push_back(error);
  }
  curve.begins = begins_of(curve.time);
  curve.speed = step_speeds(curve);
  return curve;
}

}  // namespace

ViewAxes view_axes(ViewPlane plane, const std::vector<Eigen::Vector3d>& positions_m,
                   const std::optional<Eigen::Vector3d>& up) {
  constexpr ViewAxes xy = {0, 1, 2}, xz = {0, 2, 1}, yz = {1, 2, 0};
  if (plane == ViewPlane::xy) return xy;
  if (plane == ViewPlane::xz) return xz;
  if (plane == ViewPlane::yz) return yz;
  Eigen::Index out = 1;
  if (up) {
    up->cwiseAbs().maxCoeff(&out);
  } else {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : positions_m) box.extend(p);
    const Eigen::Vector3d extent = box.sizes();
    Eigen::Index longest = 0;
    const double most = positions_m.empty() ? 0 : extent.maxCoeff(&longest);
    constexpr double flat = 0.05;
    if (most == 0 || (extent.array() < flat * most).count() == 2)
      out = longest == 1 && most > 0 ? 2 : 1;
    else
      extent.minCoeff(&out);
  }
  return out == 2 ? xy : out == 0 ? yz : xz;
}

std::string error_title(const EgoOptions& options) {
  std::string title = fmt::format("{} {} [{}]", options.rpe() ? "RPE" : "APE", to_string(options.relation),
                                  unit_of(options.relation));
  std::ranges::replace(title, '_', ' ');
  return title;
}

EgoCurves ego_curves(const std::vector<EgoResult>& runs, const EgoReference& reference,
                     const EgoOptions& options, ViewPlane plane) {
  EgoCurves curves;
  curves.axes = view_axes(plane, reference.poses.positions_m, options.up);
  curves.has_time = !reference.poses.stamps_s.empty();
  curves.error_title = error_title(options);
  const double begin_s = curves.has_time ? reference.poses.stamps_s.front() : 0;
  curves.reference = curve_of_reference(reference.poses, begin_s, curves.axes);
  for (const EgoResult& run : runs)
    curves.runs.push_back(curve_of_run(run, curves.reference, curves, begin_s));
  return curves;
}

std::vector<size_t> thinned(const TrajectoryCurve& curve, size_t most) {
  std::vector<size_t> kept;
  const size_t n = curve.size();
  const size_t per_group = curve.error.empty() ? 1 : 3;
  const size_t group = (per_group * n + most - 1) / std::max<size_t>(most, 1);
  std::vector<bool> keep(n, n <= most);
  for (size_t begin = 0; n > most && begin < n; begin += group) {
    keep[begin] = true;
    if (curve.error.empty()) continue;
    const auto finite_or = [&](size_t i, double other) {
      return std::isnan(curve.error[i]) ? other : curve.error[i];
    };
    size_t least = begin, largest = begin;
    for (size_t i = begin; i < std::min(n, begin + group); ++i) {
      if (finite_or(i, HUGE_VAL) < finite_or(least, HUGE_VAL)) least = i;
      if (finite_or(i, -HUGE_VAL) > finite_or(largest, -HUGE_VAL)) largest = i;
    }
    keep[least] = keep[largest] = true;
  }
  for (size_t i = 0; i < n; ++i) {
    if (keep[i] || i + 1 == n || curve.begins[i] || curve.begins[i + 1]) kept.push_back(i);
  }
  return kept;
}

std::vector<size_t> simplified(const std::vector<Eigen::Vector3d>& points, const std::vector<bool>& begins,
                               double tolerance) {
  const size_t n = points.size();
  std::vector<bool> keep(n, false);
  std::vector<std::pair<size_t, size_t>> stretches;  // both ends are kept, the points between them are open
  for (size_t first = 0, i = 0; i < n; ++i) {
    if (i + 1 < n && !begins[i + 1]) continue;
    keep[first] = keep[i] = true;
    stretches.emplace_back(first, i);
    first = i + 1;
  }
  while (!stretches.empty()) {
    const auto [first, last] = stretches.back();
    stretches.pop_back();
    const Eigen::Vector3d along = points[last] - points[first];
    size_t farthest = first;
    double largest = tolerance;
    for (size_t i = first + 1; i < last; ++i) {
      const Eigen::Vector3d to = points[i] - points[first];
      const double length2 = along.squaredNorm();
      const double share = length2 > 0 ? std::clamp(to.dot(along) / length2, 0.0, 1.0) : 0.0;
      const double distance = (to - share * along).norm();
      if (distance > largest) std::tie(largest, farthest) = std::pair(distance, i);
    }
    if (farthest == first) continue;
    keep[farthest] = true;
    stretches.emplace_back(first, farthest);
    stretches.emplace_back(farthest, last);
  }
  std::vector<size_t> kept;
  for (size_t i = 0; i < n; ++i) {
    if (keep[i]) kept.push_back(i);
  }
  return kept;
}

}  // namespace sextant
