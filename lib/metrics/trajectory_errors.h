#pragma once

// Selection of the pose pairs (i, j), i < j, of the relative pose error. With d_i the path length up to pose
// i, a_i the sum of rotation angles up to pose i, and delta the requested distance:
//
//   unit            consecutive (pairs do not overlap)              all pairs
//   frames          (0, delta), (delta, 2 delta), ...               every (i, i + delta)
//   metres          between the poses at which the path since the   each i with the j whose d_j - d_i is
//                   last such pose reaches delta; the first pair    nearest to delta, if within tolerance
//                   begins at the first of them
//   degrees, rad    from pose 0: whenever the sum of angles since   every (i, j) whose direct rotation angle
//                   the last pair's end reaches delta               is delta within tolerance
//   seconds         from pose 0: whenever the time since the last   each i with the j whose t_j - t_i is
//                   pair's end reaches delta                        nearest to delta, if within tolerance
//
// The tolerance is relative_tolerance * delta. Pairs by angle require a series with rotations. All units
// except seconds follow evo (evo.core.filters 1.3x).

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

enum class DeltaUnit { frames, metres, degrees, radians, seconds };
constexpr Names<5> names_of(DeltaUnit) { return {"f", "m", "deg", "rad", "s"}; }

struct PairSelection {
  double delta = 1;
  DeltaUnit unit = DeltaUnit::frames;
  bool all_pairs = false;
  double relative_tolerance = 0.1;

  /// Parses "1f", "10m", "5deg", "0.5rad" or "2s". Throws Error for anything else.
  static PairSelection parse(const std::string& text);
  std::string text() const;
};

using PosePair = std::pair<int, int>;

/// Returns the selected pairs. Throws Error if the unit is seconds and the series has no stamps, if it is an
/// angle and the series has no rotations, if no pair is found, and for all pairs by angle of more than
/// 100,000 poses (the number of pairs grows quadratically).
std::vector<PosePair> select_pairs(const PoseSeries& series, const PairSelection& selection);

// Absolute and relative pose errors of a trajectory against a reference of the same length, in evo's
// definitions (Sturm et al., A benchmark for the evaluation of RGB-D SLAM systems, IROS 2012; Kuemmerle et
// al., 2009):
//
//   APE  E_i  = inverse(P_i) Q_i                                   P estimate, Q reference (aligned before)
//   RPE  E_ij = inverse(inverse(Q_i) Q_j) inverse(P_i) P_j         pairs of select_pairs()
//
//   relation         APE                          RPE                                      unit
//   trans_part       |p_i - q_i|                  |trans E_ij|                             m
//   point_distance   |p_i - q_i|                  | |q_j - q_i| - |p_j - p_i| |            m
//   .._error_ratio   -                            point_distance / |q_j - q_i| * 100       %
//   rot_part         ||rot E - I||_F              ||rot E - I||_F                          1
//   full             ||E - I||_F                  ||E - I||_F                              1
//   angle_rad/_deg   rotation angle of E          rotation angle of E                      rad, deg
//
// Pairs are selected on the estimate, as in evo, or on the reference. Pairs between which the reference does
// not move have no ratio; evo leaves them out, and so must the caller.

enum class PoseRelation {
  trans_part,
  rot_part,
  angle_deg,
  angle_rad,
  full,
  point_distance,
  point_distance_error_ratio,  ///< relative errors only
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
/// Returns true if the relation requires rotations of both series, as a relative error if `relative`,
/// otherwise as an absolute one.
bool needs_rotations(PoseRelation relation, bool relative);

/// Returns the distance between the positions of a pair.
double pair_distance_m(const PoseSeries& series, const PosePair& pair);

/// Return the error of every pose, or of every pair in `pairs`. Throw Error if the relation requires
/// rotations and one side has none; absolute_errors() also for point_distance_error_ratio, and
/// relative_errors() throws InternalError if the reference does not move between a pair of that relation.
std::vector<double> absolute_errors(const PoseSeries& estimate, const PoseSeries& reference,
                                    PoseRelation relation);
std::vector<double> relative_errors(const PoseSeries& estimate, const PoseSeries& reference,
                                    std::span<const PosePair> pairs, PoseRelation relation);

/// Statistics of a set of errors. std is the population standard deviation (denominator n), as in numpy; the
/// median of an even number of values is the mean of the two middle ones; sse is the sum of squares.
struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, std = 0, min = 0, max = 0, sse = 0;
};
/// Returns the statistics. Throws InternalError for an empty sample, and Error if the sum of squares is not
/// finite.
ErrorStatistics error_statistics(std::span<const double> errors);

// Errors of the KITTI odometry benchmark: over every segment of 100, 200, .. 800 m of the true path that
// starts at pose 0, 10, 20, ...,
//
//   E = inverse(inverse(P_first) P_last) inverse(Q_first) Q_last      P estimate, Q truth
//   translation = |trans E| / length (%),   rotation = angle(E) / length (deg/m)
//
// averaged over all segments. `last` is the first pose whose path length from `first` exceeds the segment
// length. Recordings shorter than 100 m have no such error: n = 0, and the means are empty, never 0. Source:
// A. Geiger, P. Lenz, R. Urtasun, Are we ready for autonomous driving?, CVPR 2012, and its development kit.

struct KittiOdometryError {
  double length_m = 0;  ///< length of the segments; 0 for the mean over all lengths
  int n = 0;            ///< number of segments
  std::optional<double> translation_percent;
  std::optional<double> rotation_deg_per_m;
};

struct KittiOdometryErrors {
  KittiOdometryError all;
  std::vector<KittiOdometryError> by_length;  ///< 100 .. 800 m
  double path_m = 0;                          ///< length of the true path
};

/// Returns the errors of two series of the same length, which both have rotations. Throws InternalError for
/// series that are empty or of different lengths.
KittiOdometryErrors kitti_odometry_errors(const PoseSeries& estimate, const PoseSeries& reference);

}  // namespace sextant
