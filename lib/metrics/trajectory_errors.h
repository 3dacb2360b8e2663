#pragma once

// Absolute and relative pose errors of a path against a reference of the same length, in evo's definitions
// (Sturm et al., A benchmark for the evaluation of RGB-D SLAM systems, IROS 2012; Kuemmerle et al., 2009):
//
//   APE  E_i  = inverse(P_i) Q_i                                   P estimate, Q reference (aligned before)
//   RPE  E_ij = inverse(inverse(Q_i) Q_j) inverse(P_i) P_j         pairs of select_pairs()
//
//   relation         APE                          RPE                                      unit
//   trans_part       |p_i - q_i|                  |trans E_ij|                             m
//   point_distance   |p_i - q_i|                  | |q_j - q_i| - |p_j - p_i| |            m
//   .._error_ratio   -                            point_distance / |q_j - q_i| * 100       %
//   rot_part         ||rot E - I||_F              same                                     1
//   full             ||E - I||_F                  same                                     1
//   angle_rad/_deg   rotation angle of E          same                                     rad, deg
//
// Pairs are selected on the estimate, as evo does, or on the reference. Pairs between which the reference
// does not move have no ratio: evo leaves them out, and so must the caller.

#include <span>
#include <string_view>
#include <vector>

#include "sextant/geometry/pose_series.h"
#include "sextant/metrics/pose_pairs.h"

namespace sextant {

enum class PoseRelation {
  trans_part,
  rot_part,
  angle_deg,
  angle_rad,
  full,
  point_distance,
  point_distance_error_ratio,  ///< of relative errors only
};
constexpr Names<7> names_of(PoseRelation) {
  return {"trans_part",
          "rot_part",
          "angle_deg",
          "angle_rad",
          "full",
          "point_distance",
          "point_distance_error_ratio"};
}
std::string_view unit_of(PoseRelation relation);
/// Whether the relation is one of rotations too; `relative`: as RPE.
bool needs_rotations(PoseRelation relation, bool relative);

/// Distance of the positions of a pair.
double pair_distance_m(const PoseSeries& series, const PosePair& pair);

/// Both throw Error where the relation needs rotations and a side has none.
std::vector<double> absolute_errors(const PoseSeries& estimate, const PoseSeries& reference,
                                    PoseRelation relation);
std::vector<double> relative_errors(const PoseSeries& estimate, const PoseSeries& reference,
                                    std::span<const PosePair> pairs, PoseRelation relation);

/// std is that of the population (n, not n - 1, in the denominator), as numpy's; median the mean of the two
/// middle values where n is even; sse the sum of squares.
struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, std = 0, min = 0, max = 0, sse = 0;
};
/// Throws InternalError on an empty sample, Error on values that are not finite.
ErrorStatistics error_statistics(std::span<const double> errors);

}  // namespace sextant
