#pragma once

// Motions that do not resemble the true ones, for mistakes that no other reading of the data explains
// (motion_readings.h). Estimate and truth are compared through the factor
//
//   g = sum(e . t) / sum(t . t)          estimate e = g t + noise, truth t, in least squares
//
// over vectors of motion: translations in m or rotations, as rotation vectors in rad. An estimate without
// systematic errors has g = 1 however large its noise is; 0 is an estimate that does not follow the truth at
// all, -1 one of the opposite sign. The standard error is a jackknife over ten stretches. A factor is
// reported if four standard errors to both sides of it lie below 0.6 or above 1.6; where the truth is small,
// and so may be mostly noise, only below -0.3.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/diagnosis/motion_readings.h"

namespace sextant {

/// The factor g with its standard error; infinite if a stretch holds all of the truth's motion.
struct MotionFactor {
  double factor = 1, standard_error = 0;

  /// Formats "3.01 +- 0.05 times".
  std::string text() const;
};

/// A factor needs this many vectors.
inline constexpr size_t fewest_vectors = 10;

/// Returns the factor of the estimate on the truth, for lists of the same length; empty for fewer than ten
/// vectors or if the truth is 0.
std::optional<MotionFactor> motion_factor(std::span<const Eigen::Vector3d> truth,
                                          std::span<const Eigen::Vector3d> estimate);

/// Returns the factor if it is reported; a truth below `least_rms` may be mostly noise.
std::optional<MotionFactor> wrong_factor(std::span<const Eigen::Vector3d> truth,
                                         std::span<const Eigen::Vector3d> estimate, double least_rms);

/// RMS length of the vectors.
double rms_length(std::span<const Eigen::Vector3d> vectors);

/// Compares the given motions of objects with their reference; the texts follow the name of the motions:
///
///   large_rotations     more than a tenth of the motions turn by more than 45 deg
///   translation_factor  of the translations in the objects' own frames; small: below 0.1 m RMS
///   unexplained         the mean squared error of these translations exceeds half of their mean square, both
///                       without the largest fifth, over true steps of 0.1 m or more
///   rotation_factor     small: below 1 deg RMS
///   camera_rotation     errors of rotation, as rotation vectors in the world, are 0.4 times the rotation of
///                       the camera or more, by four standard errors
///
/// Motions are added over up to eight successive frames, so that errors of single true poses do not count as
/// motion. Motions in the world or the camera frame need the pose of the object.
std::vector<DataWarning> disagreements_of(const MotionData& data);

}  // namespace sextant
