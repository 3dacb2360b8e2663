#pragma once

// Errors of the poses of objects, T_world_object, against the true poses L of a log or of a source, an object at a
// time, as DynOSAM's evaluation takes them (metrics/trajectory_errors.h has the definitions, which are evo's):
//
//   APE        after an alignment of each object's path by itself (Umeyama, rigid): RMSE of |p - q| and of the angle
//   RPE        over steps of one pose: RMSE of the translation and of the angle
//   RPE of the path chained from the logged motions, which starts at the true pose before each stretch of them
//   per axis   e_k = log(inverse(P_k) L_k inverse(L_0) P_0) of the unaligned path, k >= 1: means of |e| for
//              x, y, z (m) and the rotation about them (deg), and the largest norm of its translation. Judd and
//              Gammell, Multimotion Visual Odometry (arXiv 2110.15169), eq. 29; Oxford Multimotion benchmark

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// RMSE over poses or steps.
struct PathError {
  size_t n = 0;
  double Et_m = 0, ER_deg = 0;
};

struct ObjectPathErrors {
  std::string system;
  uint64_t run = 0;
  int object = 0;
  std::optional<PathError> ape;  ///< empty where the positions determine no alignment: an object that stands
  std::optional<PathError> rpe, chained_rpe;
  struct PerAxis {
    Eigen::Vector3d mean_m, mean_deg;  ///< of absolute values
    double largest_m = 0;
  };
  std::optional<PerAxis> axes;
};

/// One for each object that has poses, or motions to chain, and true poses.
std::vector<ObjectPathErrors> object_path_errors(const ObjectLog& log, uint64_t run = 0);

/// A row per system, run and object.
Table object_path_table(const std::vector<ObjectPathErrors>& errors);
Table object_axis_table(const std::vector<ObjectPathErrors>& errors);

}  // namespace sextant
