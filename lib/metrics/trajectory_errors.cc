#include "sextant/metrics/trajectory_errors.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"

namespace sextant {
namespace {

constexpr double rad_per_deg = std::numbers::pi / 180;
constexpr size_t max_poses_of_all_angles = 100'000;

std::vector<PosePair> pairs_by_frames(size_t n, int delta, bool all) {
  std::vector<PosePair> pairs;
  for (size_t i = 0; i + static_cast<size_t>(delta) < n; i += all ? 1 : static_cast<size_t>(delta))
    pairs.emplace_back(static_cast<int>(i), static_cast<int>(i) + delta);
  return pairs;
}

/// Returns the pairs (i, j), j > i, whose values differ by delta within `tolerance`. Each i is paired with
/// the j whose value is nearest to values[i] + delta, the first one of a tie. The values are ascending.
std::vector<PosePair> nearest_pairs(const std::vector<double>& values, double delta, double tolerance) {
  std::vector<PosePair> pairs;
  const auto first = values.begin();
  for (auto i = first; i + 1 < values.end(); ++i) {
    const auto off = [&](double value) { return std::abs((value - *i) - delta); };
    auto best = std::partition_point(i + 1, values.end(), [&](double v) { return v - *i < delta; });
    if (best == values.end() || (best > i + 1 && off(best[-1]) <= off(*best))) --best;
    const double nearest = off(*best);
    best = std::partition_point(i + 1, best, [&](double v) { return off(v) > nearest; });
    if (nearest <= tolerance) pairs.emplace_back(i - first, best - first);
  }
  return pairs;
}

/// Returns consecutive pairs from pose 0: a pair ends at the pose where the sum of step(i), the change from
/// pose i - 1 to pose i, since the end of the previous pair reaches delta.
template <typename Step>
std::vector<PosePair> chained_pairs(size_t n, double delta, const Step& step) {
  std::vector<PosePair> pairs;
  double sum = 0;
  int begin = 0;
  for (size_t i = 1; i < n; ++i) {
    sum += step(i);
    if (sum < delta) continue;
    pairs.emplace_back(begin, static_cast<int>(i));
    begin = static_cast<int>(i);
    sum = 0;
  }
  return pairs;
}

/// Returns consecutive pairs by path length. As in evo, the first pair begins where the path from pose 0
/// reaches delta: it is the second one of chained_pairs().
std::vector<PosePair> consecutive_by_path(const PoseSeries& series, double delta) {
  std::vector<PosePair> pairs = chained_pairs(series.size(), delta, [&](size_t i) {
    return (series.positions_m[i] - series.positions_m[i - 1]).norm();
  });
  if (!pairs.empty()) pairs.erase(pairs.begin());
  return pairs;
}

std::vector<PosePair> consecutive_by_angle(const PoseSeries& series, double delta_rad) {
  return chained_pairs(series.size(), delta_rad, [&](size_t i) {
    return rotation_angle_rad(Eigen::Quaterniond(relative_pose(series, i - 1, i).rotation));
  });
}

std::vector<PosePair> all_by_angle(const PoseSeries& series, double delta_rad, double tolerance_rad) {
  if (series.size() > max_poses_of_all_angles) {
    fail(
        "all pairs by angle: got {} poses, expected at most {}: leave --all-pairs out, or select a part with "
        "--t-start and --t-end",
        series.size(), max_poses_of_all_angles);
  }
  std::vector<Eigen::Quaterniond> q;
  q.reserve(series.size());
  for (const Eigen::Matrix3d& r : series.rotations) q.push_back(Eigen::Quaterniond(r).normalized());
  const double low = delta_rad - tolerance_rad;
  const double high = delta_rad + tolerance_rad;
  // |w| of a relative rotation decreases with its angle: this cheap test precedes the exact one.
  const double w_low = std::cos(std::clamp(high / 2, 0.0, std::numbers::pi / 2)) - 1e-9;
  const double w_high = std::cos(std::clamp(low / 2, 0.0, std::numbers::pi / 2)) + 1e-9;
  std::vector<PosePair> pairs;
  for (size_t i = 0; i + 1 < q.size(); ++i) {
    for (size_t j = i + 1; j < q.size(); ++j) {
      const double w = std::abs(q[i].dot(q[j]));
      if (w < w_low || w > w_high) continue;
      const double angle = rotation_angle_rad(q[i].conjugate() * q[j]);
      if (low <= angle && angle <= high) pairs.emplace_back(static_cast<int>(i), static_cast<int>(j));
    }
  }
  return pairs;
}

std::vector<PosePair> pairs_by_time(const PoseSeries& series, const PairSelection& selection) {
  if (series.stamps_s.empty())
    fail(
        "pairs in seconds need time stamps, which these poses do not have: give the distance in frames, e.g. "
        "10f");
  const std::vector<double>& t = series.stamps_s;
  if (selection.all_pairs)
    return nearest_pairs(t, selection.delta, selection.delta * selection.relative_tolerance);
  std::vector<PosePair> pairs;
  constexpr double rounding_s = 1e-6;  // so that 10 steps of 0.1 s make 1 s with rounded stamps
  for (size_t i = 1, begin = 0; i < t.size(); ++i) {
    if (t[i] - t[begin] < selection.delta - rounding_s) continue;
    pairs.emplace_back(static_cast<int>(begin), static_cast<int>(i));
    begin = i;
  }
  return pairs;
}

std::vector<PosePair> pairs_of(const PoseSeries& series, const PairSelection& s) {
  const double delta_rad = s.delta * (s.unit == DeltaUnit::degrees ? rad_per_deg : 1);
  switch (s.unit) {
    case DeltaUnit::frames:
      return pairs_by_frames(series.size(), static_cast<int>(s.delta), s.all_pairs);
    case DeltaUnit::metres:
      if (!s.all_pairs) return consecutive_by_path(series, s.delta);
      return nearest_pairs(path_lengths_m(series), s.delta, s.delta * s.relative_tolerance);
    case DeltaUnit::degrees:
    case DeltaUnit::radians:
      if (!s.all_pairs) return consecutive_by_angle(series, delta_rad);
      return all_by_angle(series, delta_rad, delta_rad * s.relative_tolerance);
    case DeltaUnit::seconds:
      return pairs_by_time(series, s);
  }
  SEXTANT_CHECK(false);
}

}  // namespace

PairSelection PairSelection::parse(const std::string& text) {
  constexpr const char* form = "expected a number and a unit: 1f (frames), 10m, 5deg, 0.5rad or 2s";
  PairSelection s;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), s.delta);
  const std::string_view unit(end, static_cast<size_t>(text.data() + text.size() - end));
  const std::optional<DeltaUnit> known = find_name<DeltaUnit>(unit);
  if (error != std::errc() || !known) fail("--rpe {}: {}", text, form);
  s.unit = *known;
  if (!(s.delta > 0) || !std::isfinite(s.delta)) fail("--rpe {}: expected a finite distance above 0", text);
  if (s.unit == DeltaUnit::frames && (s.delta != std::trunc(s.delta) || s.delta > 1e9))
    fail("--rpe {}: expected a whole number of frames, at most 1e9", text);
  if ((s.unit == DeltaUnit::degrees && s.delta > 180) ||
      (s.unit == DeltaUnit::radians && s.delta > std::numbers::pi))
    fail("--rpe {}: expected an angle of at most 180 deg", text);
  return s;
}

std::string PairSelection::text() const { return fmt::format("{}{}", delta, to_string(unit)); }

std::vector<PosePair> select_pairs(const PoseSeries& series, const PairSelection& selection) {
  const bool by_angle = selection.unit == DeltaUnit::degrees || selection.unit == DeltaUnit::radians;
  if (by_angle && !series.has_rotations()) {
    fail(
        "--rpe {}: pairs by angle need rotations, but these poses are positions alone: give a distance in m, "
        "s or f",
        selection.text());
  }
  std::vector<PosePair> pairs = pairs_of(series, selection);
  if (pairs.empty()) {
    fail("no two poses are {} apart among {} poses: use a smaller distance{}", selection.text(),
         series.size(), selection.all_pairs ? " or a larger --delta-tolerance" : "");
  }
  return pairs;
}

namespace {

double value_of(const RelativePose& E, PoseRelation relation) {
  switch (relation) {
    case PoseRelation::trans_part:
      return E.translation_m.norm();
    case PoseRelation::rot_part:
      return (E.rotation - Eigen::Matrix3d::Identity()).norm();
    case PoseRelation::full:
      return std::sqrt((E.rotation - Eigen::Matrix3d::Identity()).squaredNorm() +
                       E.translation_m.squaredNorm());
    case PoseRelation::angle_rad:
      return rotation_angle_rad(Eigen::Quaterniond(E.rotation));
    case PoseRelation::angle_deg:
      return rotation_angle_rad(Eigen::Quaterniond(E.rotation)) * (180 / std::numbers::pi);
    case PoseRelation::point_distance:
    case PoseRelation::point_distance_error_ratio:
      break;  // not functions of E
  }
  SEXTANT_CHECK(false);
}

/// Returns inverse(a) b.
RelativePose difference(const RelativePose& a, const RelativePose& b) {
  return {a.rotation.transpose() * b.rotation, a.rotation.transpose() * (b.translation_m - a.translation_m)};
}

}  // namespace

std::string_view unit_of(PoseRelation relation) {
  constexpr Names<7> units = {"m", "1", "deg", "rad", "1", "m", "%"};
  return units.at(static_cast<size_t>(relation));
}

bool needs_rotations(PoseRelation relation, bool relative) {
  if (relation == PoseRelation::trans_part) return relative;
  return relation != PoseRelation::point_distance && relation != PoseRelation::point_distance_error_ratio;
}

namespace {

void check_rotations(const PoseSeries& estimate, const PoseSeries& reference, PoseRelation relation,
                     bool relative) {
  if (!needs_rotations(relation, relative) || (estimate.has_rotations() && reference.has_rotations())) return;
  fail("{} of {} poses needs rotations, but the {} has positions alone: use --relation {}",
       to_string(relation), relative ? "relative" : "absolute",
       reference.has_rotations() ? "estimate" : "reference",
       relative ? "point_distance" : "trans_part or point_distance");
}

}  // namespace

double pair_distance_m(const PoseSeries& series, const PosePair& pair) {
  return (series.positions_m[static_cast<size_t>(pair.first)] -
          series.positions_m[static_cast<size_t>(pair.second)])
      .norm();
}

std::vector<double> absolute_errors(const PoseSeries& estimate, const PoseSeries& reference,
                                    PoseRelation relation) {
  SEXTANT_CHECK(estimate.size() == reference.size());
  if (relation == PoseRelation::point_distance_error_ratio)
    fail("{} is a share of the distance between two poses: also give the distance, e.g. --rpe 10m",
         to_string(relation));
  check_rotations(estimate, reference, relation, false);
  const bool positions_alone = !needs_rotations(relation, false);
  std::vector<double> errors(estimate.size());
  for (size_t i = 0; i < errors.size(); ++i) {
    if (positions_alone) {
      errors[i] = (estimate.positions_m[i] - reference.positions_m[i]).norm();
    } else {
      errors[i] = value_of(difference({estimate.rotations[i], estimate.positions_m[i]},
                                      {reference.rotations[i], reference.positions_m[i]}),
                           relation);
    }
  }
  return errors;
}

std::vector<double> relative_errors(const PoseSeries& estimate, const PoseSeries& reference,
                                    std::span<const PosePair> pairs, PoseRelation relation) {
  SEXTANT_CHECK(estimate.size() == reference.size());
  check_rotations(estimate, reference, relation, true);
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const PosePair& pair : pairs) {
    if (relation == PoseRelation::point_distance || relation == PoseRelation::point_distance_error_ratio) {
      const double distance_m = pair_distance_m(reference, pair);
      const double error_m = std::abs(distance_m - pair_distance_m(estimate, pair));
      SEXTANT_CHECK(relation == PoseRelation::point_distance || distance_m > 0);
      errors.push_back(relation == PoseRelation::point_distance ? error_m : error_m / distance_m * 100);
      continue;
    }
    const auto i = static_cast<size_t>(pair.first), j = static_cast<size_t>(pair.second);
    errors.push_back(
        value_of(difference(relative_pose(reference, i, j), relative_pose(estimate, i, j)), relation));
  }
  return errors;
}

ErrorStatistics error_statistics(std::span<const double> errors) {
  SEXTANT_CHECK(!errors.empty());
  const auto n = static_cast<double>(errors.size());
  ErrorStatistics s;
  double sum = 0;
  for (const double e : errors) {
    sum += e;
    s.sse += e * e;
  }
  if (!std::isfinite(s.sse)) fail("the errors overflow: are the positions in metres?");
  s.mean = sum / n;
  s.rmse = std::sqrt(s.sse / n);
  double spread = 0;
  for (const double e : errors) spread += (e - s.mean) * (e - s.mean);
  s.std = std::sqrt(spread / n);
  std::vector<double> values(errors.begin(), errors.end());
  s.median = quantile_of(values, 0.5);
  const auto [low, high] = std::minmax_element(errors.begin(), errors.end());
  s.min = *low;
  s.max = *high;
  return s;
}

namespace {

constexpr size_t frames_between_stretches = 10;
constexpr std::array<double, 8> lengths_m = {100, 200, 300, 400, 500, 600, 700, 800};

struct Sum {
  double translation = 0;  // m/m
  double rotation = 0;     // rad/m
  int n = 0;
};

KittiOdometryError mean_of(const Sum& sum, double length_m) {
  KittiOdometryError e{length_m, sum.n, {}, {}};
  if (sum.n == 0) return e;
  e.translation_percent = 100 * sum.translation / sum.n;
  e.rotation_deg_per_m = 180 / std::numbers::pi * sum.rotation / sum.n;
  return e;
}

}  // namespace

KittiOdometryErrors kitti_odometry_errors(const PoseSeries& estimate, const PoseSeries& reference) {
  SEXTANT_CHECK(estimate.size() == reference.size() && !reference.empty());
  const std::vector<double> path = path_lengths_m(reference);
  std::array<Sum, lengths_m.size()> sums;
  for (size_t first = 0; first < path.size(); first += frames_between_stretches) {
    for (size_t k = 0; k < lengths_m.size(); ++k) {
      const auto last = std::upper_bound(path.begin() + static_cast<std::ptrdiff_t>(first), path.end(),
                                         path[first] + lengths_m[k]);
      if (last == path.end()) break;
      const auto j = static_cast<size_t>(last - path.begin());
      const RelativePose E =
          difference(relative_pose(estimate, first, j), relative_pose(reference, first, j));
      sums[k].translation += E.translation_m.norm() / lengths_m[k];
      sums[k].rotation += rotation_angle_rad(Eigen::Quaterniond(E.rotation)) / lengths_m[k];
      ++sums[k].n;
    }
  }
  KittiOdometryErrors errors;
  errors.path_m = path.back();
  Sum all;
  for (size_t k = 0; k < sums.size(); ++k) {
    errors.by_length.push_back(mean_of(sums[k], lengths_m[k]));
    all = {all.translation + sums[k].translation, all.rotation + sums[k].rotation, all.n + sums[k].n};
  }
  errors.all = mean_of(all, 0);
  return errors;
}

}  // namespace sextant
