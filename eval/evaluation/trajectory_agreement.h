#pragma once

// Agreement of two matched paths, as they are or after an alignment.

#include <Eigen/Core>
#include <optional>

#include "sextant/geometry/trajectory.h"
#include "sextant/metrics/trajectory_alignment.h"

namespace sextant {

/// Alignment of the paths; the members are the arguments of align().
struct AlignmentChoice {
  Alignment alignment = Alignment::none;
  int n_to_align = 0;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  ///< needed for Alignment::yaw only
};

/// Differences between two paths.
struct Agreement {
  size_t n = 0;          ///< number of compared poses, which thinned() may have reduced
  double squares = 0;    ///< sum of squared distances, m^2
  double angle_deg = 0;  ///< mean angle between rotations

  double mean_squares_m2() const { return squares / static_cast<double>(n); }
};

/// Takes every k-th of the `n` poses from pose `first` on, at most 1000, which suffice for one constant. The
/// other poses are never copied, since a trajectory may take most of the memory.
PoseSeries thinned(const PoseSeries& series, size_t first, size_t n);
/// Overload for all poses.
PoseSeries thinned(const PoseSeries& series);

Eigen::Vector3d mean_position(const PoseSeries& series);
/// RMS distance of the positions from their mean, m.
double rms_extent_m(const PoseSeries& series);

/// Returns true for an alignment that rotates the world about any axis.
bool turns_world(Alignment alignment);

/// Compares two matched paths as they are.
Agreement agreement(const PoseSeries& reference, const PoseSeries& estimate);

/// Turns the estimate about the principal axis of the reference's path, such that the sum of squared chordal
/// distances of the rotations is least.
void turn_about_path(PoseSeries& estimate, const PoseSeries& reference);

/// Aligns as chosen; returns false if the poses do not determine the alignment. The turn about a path on a
/// line, which its positions do not determine, is that of turn_about_path().
bool try_align(PoseSeries& estimate, const PoseSeries& reference, const AlignmentChoice& choice);

/// Returns the agreement of the thinned paths after the alignment; empty if the poses do not determine it.
std::optional<Agreement> aligned_agreement(const PoseSeries& reference, const PoseSeries& estimate,
                                           const AlignmentChoice& choice);

}  // namespace sextant
