#pragma once

// What the reproduction runs: each part is a folder below DIR/parts that is complete or can be resumed.
// How to add one: a plan in eval/plans/reproduce/ and one line in the table of parts.cc.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/records/output.h"
#include "sextant/eval/report/evidence.h"

namespace sextant {

enum class PartKind {
  sweep,     ///< a plan, from packs
  recorded,  ///< trajectories of other systems against the truth
  recorded_objects,  ///< object logs of other systems against the truth
  timing,    ///< one thread, sources decoded, no packs: run times
  showcase,  ///< a run with paths, and the picture of its last pair
  stored,    ///< results/systems: errors of published systems, measured once
};

struct Part {
  std::string name;
  PartRole role = PartRole::sets;
  PartKind kind = PartKind::sweep;
  std::string title;
  std::string needs;  ///< folder below the data root; empty: comes with the program
  std::string fetch;  ///< how to get it
  std::string plan;   ///< JSON; empty for recorded and stored parts
  std::string beside{};  ///< `stored`: the earlier part whose records have the truth of the same frames
};

/// In the order in which they run: what comes with the program first. The text of Virtual KITTI is taken from
/// ROOT/vkitti_1.3.1_text, or from ROOT/vkitti_1.3.1 where only that is there.
std::vector<Part> reproduction_parts(const std::string& data_root);

/// Why a part cannot run with this data; empty when it can.
std::string what_is_missing(const Part& part, const std::string& data_root);

// ---- published systems, measured once with the external protocol (docs/external-estimators.md) and stored:
// results/systems/PART/records.jsonl holds their errors, run.json by what and on which machine they were
// measured. The files come with the program.
//
// The stored records have no truth values: of real data those are not ours to copy. They are taken from the
// records of the part that was measured here on the same frames.

/// records.jsonl and run.json of a stored part. Records of frames and bodies that `beside` does not have are
/// left out. Throws Error where there is no such part, or `beside` has no records.jsonl.
OutputFiles stored_files(const std::string& part, const std::filesystem::path& beside);

// ---- recorded camera trajectories of other systems on KITTI tracking, as records: per frame pair the paper's
// pose change error against the truth.
//
//   ROOT/kitti_tracking                                     truth (text is enough)
//   ROOT/kitti_tracking_peers/orbslam3_camera/0003.txt      KITTI format
//   ROOT/kitti_tracking_peers/vdo_slam_frontend/0000.xml    VDO-SLAM's log
//
//   errors.Et_m, ER_deg        against the raw truth
//   errors.Et_corrected_m      against the truth with velocity-corrected step lengths
//   errors.Et_scaled_m         raw truth, the estimate scaled to the truth's size (Umeyama, scale only)
//   values.step_gt_m, step_floor_m

/// A system whose camera trajectories were recorded.
struct RecordedSystem {
  const char* name;
  const char* folder;     ///< below ROOT/kitti_tracking_peers; begins the names of its trajectories here
  const char* extension;
  const char* format;     ///< of read_trajectory()
};
std::span<const RecordedSystem> recorded_systems();

/// The paper's sequences of which text truth is known to be public: "0000" .. "0020".
const std::vector<std::string>& recorded_sequences();

/// Files that evaluate_recorded() would read, as path -> SHA-256.
Json recorded_inputs(const std::string& data_root);

/// records.jsonl, run.json, and per system and sequence <system>_<sequence>_{reference,estimate}.tum.
OutputFiles evaluate_recorded(const std::string& data_root);

// ---- recorded object motions: DynOSAM's logs of a sequence of KITTI tracking, in ROOT/dynosam_kitti_0000. The
// truth is the data set's own; errors as `evaluate objects` gives them.

/// Files that evaluate_recorded_objects() would read, as path -> SHA-256.
Json recorded_object_inputs(const std::string& data_root);

/// records.jsonl and run.json, with the estimators "DynOSAM front end" and "DynOSAM back end".
OutputFiles evaluate_recorded_objects(const std::string& data_root);

}  // namespace sextant
