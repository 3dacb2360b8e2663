#pragma once

// Whether the covariances of logged objects fit their errors: the NEES of trajectory_consistency.h, an object at a time.
//
//   of poses    T_world_object against the true poses, in one world, without an alignment
//   of motions  the motions against the true motions, in the frame of the log

#include <cstdint>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/trajectory_consistency.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/report/table.h"

namespace sextant {

struct ObjectConsistency {
  std::string system;
  uint64_t run = 0;
  int object = 0;
  TrajectoryConsistency nees;
};

/// One for each object with covariances and truth. Throws Error as trajectory_consistency() does.
std::vector<ObjectConsistency> object_consistency(const ObjectLog& log, uint64_t run = 0);

/// A row per system, run and object.
Table object_consistency_table(const std::vector<ObjectConsistency>& found);

}  // namespace sextant
