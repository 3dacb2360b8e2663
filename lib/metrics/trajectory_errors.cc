#include "sextant/metrics/trajectory_errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"

namespace sextant {
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
      break;  // no functions of E
  }
  SEXTANT_CHECK(false);
}

/// inverse(a) b
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
  fail("{} of {} poses needs rotations, but the {} has positions alone: use --relation {}", to_string(relation),
       relative ? "relative" : "absolute", reference.has_rotations() ? "estimate" : "reference",
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
    fail("{} is a share of the distance between two poses: give --rpe too, e.g. --rpe 10m",
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
  if (!std::isfinite(s.sse)) fail("the errors overflow: the positions are no metres");
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

}  // namespace sextant
