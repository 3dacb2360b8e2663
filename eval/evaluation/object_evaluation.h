#pragma once

// Scores logged object motions under every metric preset. With H the motion from frame k-1 to k in the world,
// L the true T_world_object at k-1 and T the camera's T_world_camera (docs/metrics.md):
//
//   Et_world   E of H                       Et_body   E of inverse(L) H L
//   Et (camera) E of inverse(T_k) H T_k-1, the estimate with its own cameras
//   v = |trans(inverse(L) H L)| / dt: the displacement of the object's true origin (logs hold no points)
//
// A log in the body frame determines the other errors only if L is known; errors that a preset needs but the
// log does not determine stay empty. Coverage is the share of steps with truth that have an estimate. Truth
// for steps that the log lacks comes from the true motions or poses of the log or of a source. Without a
// source, steps that the log lacks between the first and the last frame of an object count as steps without
// an estimate.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/evaluation/run_statistics.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/table.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

/// Returns one record per object and frame with a motion or truth. Its status is ok, no_truth or, for truth
/// without an estimate, lost (the object is in the log at other frames) or not_detected. `run` becomes the
/// seed of the records.
std::vector<Record> object_records(const ObjectLog& log, const std::string& dataset,
                                   const std::string& sequence, double rate_hz, uint64_t run = 0);

/// Table with one row per preset, system and object, and one over all objects, with all runs together; cells
/// stay empty if a preset has no errors.
Table object_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);

// ---- Results over the logs of several runs: pooled scores with intervals, comparisons of systems and, in
// the document, the distributions of the errors that a preset uses. The seed of a record is the run: its
// place on the command line.

/// Table with one row per preset and system: E_t and E_R over all objects and runs, with 95 % intervals over
/// runs.
Table object_system_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);
/// Table with one row per error and pair of systems; without rows for a single system.
Table object_comparison_table(const std::vector<Record>& records, std::span<const MetricPreset> presets);

// ---- Errors of the poses of objects, T_world_object, against the true poses L of a log or of a source, for
// each object, as in DynOSAM's evaluation. The definitions are evo's (metrics/trajectory_errors.h):
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

/// Returns the logged path of each object, named obj_<id>, after a rigid alignment to its true path, with the
/// distances of the positions as errors; objects whose positions do not determine an alignment are left out.
/// The time of a pose is frame / rate.
std::vector<EgoResult> aligned_object_paths(const ObjectLog& log, double rate_hz);

/// Table of APE and RPE with one row per system, run and object.
Table object_path_table(const std::vector<ObjectPathErrors>& errors);
/// Table of the errors per axis with one row per system, run and object.
Table object_axis_table(const std::vector<ObjectPathErrors>& errors);

// ---- Plausibility of logged object motions by themselves, without another reading of the log: speeds
// that no vehicle reaches, estimates that are the identity, and steps without an estimate.

/// Returns the true motions of a log, also those without an estimate.
std::map<ObjectFrame, SE3> true_motions(const ObjectLog& log);

/// Returns the poses of a camera in the form of an object's path, with id 0.
std::map<ObjectFrame, SE3> camera_poses(const Trajectory& camera);

/// Returns the poses of one object in order of frames.
PoseSeries object_series(const std::map<ObjectFrame, SE3>& poses, int id);

/// Throws Error that names the line if the log's own truth moves an object at more than 100 m/s, or if
/// successive true poses of an object or of the camera are more than 50 m apart at 10 Hz (500 m/s). The
/// message includes the diagnoses `found`.
void check_plausible(const ObjectLog& log, double rate_hz, const std::vector<DataWarning>& found);

/// Reports objects whose median estimated speed is above 100 m/s, which no vehicle reaches.
std::vector<DataWarning> diagnose_speeds(const ObjectLog& log, double rate_hz);

/// Returns by object the steps whose estimate is the identity (within 1e-6) although the object moves, as
/// written by a tracker that failed (DynOSAM's issue 20). Objects without such steps are left out.
std::map<int, std::vector<int>> identity_steps(const ObjectLog& log);

/// Returns by object the steps without an estimate between the first and the last step that has an estimate
/// or truth. If the truth is that of a data set (take_truth()), only steps with truth count.
std::map<int, std::vector<int>> missing_steps(const ObjectLog& log);

/// Formats ascending frame numbers as ranges, e.g. "20-29, 40", with at most `most` groups and the number of
/// further ones.
std::string ranges_text(const std::vector<int>& frames, size_t most = 6);

// ---- Diagnoses of logged object motions (object_diagnosis.cc). Other readings of the log (eval/diagnosis)
// are compared with its truth, with its own poses, or with the true objects of a data set.
//
//   compared                                      diagnoses
//   motions of the log        true motions        the estimates, of all objects or of single ones
//   true motions              true poses          the truth of the log
//   motions of the log        poses of the log    the log's motions or poses
//   poses of the log          true poses          the log's poses
//   camera of the log         true camera         the log's cameras
//   whole log                 data set's truth    the log, before its objects are matched to true ones: each
//                                                 reading is compared with the true object that it fits best

/// Compares the log with its own truth and its motions with its poses.
std::vector<DataWarning> diagnose_log(const ObjectLog& log);

/// Compares the unmodified log with the truth of a data set.
std::vector<DataWarning> diagnose_log(const ObjectLog& log, const SequenceTruth& truth);

/// Diagnoses of a log whose objects have their truth (its own, or by take_truth()) but do not resemble it,
/// for mistakes that nothing else explains: the findings of disagreements_of() (motion_disagreement.h), or,
/// if there are none, `object_axes`: the axes of the poses are turned by the same rotation against the true
/// ones, by 20 deg or more, within 10 deg RMS.
std::vector<DataWarning> diagnose_disagreement(const ObjectLog& log);

// ---- Diagnoses by ids and frames (object_identities.cc).

/// Reports objects whose positions follow another true object than their own, in at least 5 frames: the mean
/// squared distance from the other one must be smaller by explains_times_of(), and its root at most 3 m. The
/// log's truth may be that of a data set (take_truth()).
std::vector<DataWarning> diagnose_identities(const ObjectLog& log);

/// Reports objects that have no frame in common with the log's camera or with the true one.
std::vector<DataWarning> diagnose_frames(const ObjectLog& log, const Trajectory& true_camera);

}  // namespace sextant
