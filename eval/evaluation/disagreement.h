#pragma once

// Warnings of an estimate that does not resemble its truth, for mistakes that no other reading of the data
// (eval/diagnosis) explains. They compare the estimate with the truth through the factor
//
//   g = sum(e . t) / sum(t . t)          estimate e = g t + noise, truth t, in least squares
//
// over vectors of motion: translations in m or rotations, as rotation vectors in rad. An estimate without
// systematic errors has g = 1 however large its noise is; 0 is an estimate that does not follow the truth at
// all, -1 one of the opposite sign. The standard error is a jackknife over ten stretches. A factor is
// reported if four standard errors to both sides of it lie below 0.6 or above 1.6; where the truth is smaller
// than the table says, and so may be mostly noise, only below -0.3.
//
//   code                what, and when it is reported
//   unexplained         path of a camera: the best of the requested alignment, se3 and sim3 leaves an RMSE
//                       above 0.3 of the RMS extent of the reference, if that is 0.5 m or more, and motions
//                       over pieces of the path disagree, too, unlike those of an odometry that drifts
//   rotation_factor     rotations of a camera about each axis of its body, over steps that turn by 3 deg RMS:
//                       factor; the reference turns by 0.5 deg RMS or more about this axis
//   large_rotations     rotations of objects from frame to frame: more than a tenth exceed 45 deg
//   translation_factor  translations of objects in their own frame: factor; 0.1 m RMS or more
//   unexplained         the same, over steps of 0.1 m or more: the mean squared error exceeds half of the
//                       mean squared motion, both without the largest fifth
//   rotation_factor     rotations of objects: factor; 1 deg RMS or more
//   camera_rotation     errors of rotation of objects: 0.4 times the rotation of the camera or more, by four
//                       standard errors
//   object_axes         axes of the poses of objects: turned by the same rotation against the true ones, by
//                       20 deg or more, within 10 deg RMS
//
// Motions of objects are added over up to eight successive frames, so that errors of single true poses do not
// count as motion.

#include <optional>
#include <span>
#include <vector>

#include "sextant/eval/evaluation/object_evaluation.h"
#include "sextant/eval/evaluation/trajectory_explanation.h"

namespace sextant {

/// The factor g with its standard error; infinite if a stretch holds all of the truth's motion.
struct MotionFactor {
  double factor = 1, standard_error = 0;
};

/// Returns the factor of the estimate on the truth, for lists of the same length; empty for fewer than ten
/// vectors or if the truth is 0.
std::optional<MotionFactor> motion_factor(std::span<const Eigen::Vector3d> truth,
                                          std::span<const Eigen::Vector3d> estimate);

/// Warnings of a matched, not yet aligned pair of trajectories.
std::vector<TrajectoryWarning> warnings_of_disagreement(const PoseSeries& reference,
                                                        const PoseSeries& estimate,
                                                        const AlignmentChoice& choice);

/// Diagnoses of a log whose objects have their truth (its own, or by take_truth()).
std::vector<LogDiagnosis> diagnose_disagreement(const ObjectLog& log);

}  // namespace sextant
