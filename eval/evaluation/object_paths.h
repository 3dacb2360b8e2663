#pragma once

// Errors of the poses of objects, T_world_object, against the true poses L of a log or of a source, for each
// object, as in DynOSAM's evaluation. The definitions are evo's (metrics/trajectory_errors.h):
//
//   APE        after aligning the path of each object separately (Umeyama, rigid): RMSE of |p - q| and of the
//              angle
//   RPE        over steps of one pose: RMSE of the translation and of the angle
//   chained    RPE of the path chained from the logged motions, which starts at the true pose before each
//              stretch
//   per axis   e_k = log(inverse(P_k) L_k inverse(L_0) P_0) of the unaligned path, k >= 1: means of |e| for
//              x, y, z (m) and the rotation about them (deg), and the largest norm of its translation. Judd
//              and Gammell, Multimotion Visual Odometry (arXiv 2110.15169), eq. 29; Oxford Multimotion
//              benchmark

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// RMSE over the poses (APE) or the steps (RPE).
struct PathError {
  size_t n = 0;
  double Et_m = 0, ER_deg = 0;
};

/// Errors of one object in one run.
struct ObjectPathErrors {
  std::string system;
  uint64_t run = 0;
  int object = 0;
  /// Empty if the positions do not determine an alignment, as for an object that stands still
  std::optional<PathError> ape;
  std::optional<PathError> rpe, chained_rpe;
  struct PerAxis {
    Eigen::Vector3d mean_m, mean_deg;  ///< means of absolute values
    double largest_m = 0;
  };
  std::optional<PerAxis> axes;
};

/// Returns the errors of each object that has true poses, and poses or motions to chain.
std::vector<ObjectPathErrors> object_path_errors(const ObjectLog& log, uint64_t run = 0);

/// Table of APE and RPE with one row per system, run and object.
Table object_path_table(const std::vector<ObjectPathErrors>& errors);
/// Table of the errors per axis with one row per system, run and object.
Table object_axis_table(const std::vector<ObjectPathErrors>& errors);

}  // namespace sextant
