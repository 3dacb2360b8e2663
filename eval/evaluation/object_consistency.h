#pragma once

// Consistency of the covariances of logged objects with their errors: the NEES of trajectory_consistency.h
// for each object.
//
//   pose covariances     errors of T_world_object against the true poses, in one world, without an alignment
//   motion covariances   errors of the motions against the true motions, in the frame of the log

#include <cstdint>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/trajectory_consistency.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// NEES of one object in one run.
struct ObjectConsistency {
  std::string system;
  uint64_t run = 0;
  int object = 0;
  TrajectoryConsistency nees;
};

/// Returns the NEES of each object that has covariances and truth. Throws Error as trajectory_consistency()
/// does.
std::vector<ObjectConsistency> object_consistency(const ObjectLog& log, uint64_t run = 0);

/// Table with one row per system, run and object.
Table object_consistency_table(const std::vector<ObjectConsistency>& found);

}  // namespace sextant
