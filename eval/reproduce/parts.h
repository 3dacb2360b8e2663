#pragma once

// Experiments of the reproduction. Each is a folder below DIR/parts that is complete or can be resumed. How
// to add one: a plan in eval/plans/reproduce/ and one line in the table of parts.cc.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/records/output.h"
#include "sextant/eval/report/evidence.h"

namespace sextant {

/// One experiment. What is run follows from its fields:
///   `beside` given          errors of published systems, measured once and stored in results/systems
///   role recorded           recorded trajectories of other systems against the truth
///   role recorded_objects   recorded object logs of other systems against the truth
///   role timing             run times: one thread, decoded sources, no correspondence cache
///   role showcase           a run with paths, and the picture of its last frame pair
///   otherwise               a sweep from correspondence caches
struct Part {
  std::string name;
  PartRole role = PartRole::sets;
  std::string title;
  std::string needs;     ///< folder below the data root that it needs; empty: the data come with the program
  std::string fetch;     ///< command that obtains these data
  std::string plan;      ///< JSON; empty for recorded and stored experiments
  std::string beside{};  ///< earlier experiment whose records have the truth of the same frames

  bool is_stored() const { return !beside.empty(); }
};

/// Returns the experiments in the order in which they run: first those on the embedded scenarios, and each
/// stored experiment after the one that it needs (`beside`). The text files of Virtual KITTI are read from
/// ROOT/vkitti_1.3.1_text or, if this folder does not exist, from ROOT/vkitti_1.3.1.
std::vector<Part> reproduction_parts(const std::string& data_root);

/// Explains why an experiment cannot run with this data; empty if it can.
std::string what_is_missing(const Part& part, const std::string& data_root);

// ---- Published systems, measured once with the external protocol (docs/external-estimators.md) and stored.
// results/systems/PART/records.jsonl contains their errors, and run.json the program and the machine that
// measured them. These files come with the program.
//
// The stored records have no truth values, because those of real data may not be redistributed. The truth
// values are taken from the records of the experiment that was measured here on the same frames.

/// Returns records.jsonl and run.json of a stored experiment. Records of frames and bodies that `beside` does
/// not have are left out. Throws Error if the experiment does not exist, or if `beside` has no records.jsonl.
OutputFiles stored_files(const std::string& part, const std::filesystem::path& beside);

// ---- Recorded camera trajectories of other systems on KITTI tracking, converted to records: the paper's
// pose change error against the truth for each frame pair.
//
//   ROOT/kitti_tracking                                     truth (text is enough)
//   ROOT/kitti_tracking_peers/orbslam3_camera/0003.txt      KITTI format
//   ROOT/kitti_tracking_peers/vdo_slam_frontend/0000.xml    VDO-SLAM's log
//
//   errors.Et_m, ER_deg        against the raw truth
//   errors.Et_corrected_m      against the truth with velocity-corrected step lengths
//   errors.Et_scaled_m         raw truth, the estimate scaled to the truth's size (Umeyama, scale only)
//   values.step_gt_m, step_floor_m, and other floors of the truth

/// A system with recorded camera trajectories.
struct RecordedSystem {
  const char* name;
  /// Below ROOT/kitti_tracking_peers; also the prefix of its trajectories in the results
  const char* folder;
  const char* extension;
  const char* format;  ///< format name for read_trajectory()
};
std::span<const RecordedSystem> recorded_systems();

/// Returns the paper's sequences whose truth is publicly available as text: "0000" to "0006", "0018", "0020".
const std::vector<std::string>& recorded_sequences();

/// Returns the files that evaluate_recorded() would read, as path -> SHA-256. Throws Error if there is no
/// trajectory.
Json recorded_inputs(const std::string& data_root);

/// Returns records.jsonl, run.json, and for each system and sequence
/// <system>_<sequence>_{reference,estimate}.tum.
OutputFiles evaluate_recorded(const std::string& data_root);

// ---- Recorded object motions: DynOSAM's logs of a sequence of KITTI tracking, in ROOT/dynosam_kitti_0000.
// The truth comes from the data set; errors are those of `sextant evaluate objects`.

/// Returns the files that evaluate_recorded_objects() would read, as path -> SHA-256.
Json recorded_object_inputs(const std::string& data_root);

/// Returns records.jsonl and run.json. The estimators are called "DynOSAM front end" and "DynOSAM back end".
OutputFiles evaluate_recorded_objects(const std::string& data_root);

}  // namespace sextant
