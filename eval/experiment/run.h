#pragma once

// Runs one estimator over sources and compares with their ground truth: a plan of one level, whose cases are
// the seeds. Per source, in windows of frames (bounded memory): decode every frame once and extract the
// pairs' points, in parallel; then the cases over the pairs (case_runner.h). The outcome does not depend on
// `jobs`, times excepted. Nothing is written here: run_files() makes the files.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/experiment/run_options.h"
#include "sextant/eval/records/fingerprint.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"

namespace sextant {

class RunJournal;

struct RunConfig {
  std::vector<SourceSpec> sources;
  std::string estimator = "joint_flow";  ///< as make_case_estimator() takes it
  Json options = Json::object();         ///< strict tree: "extraction", "pipeline", "estimator", "source"
  Noise noise;                           ///< on masks: before extraction; all other: on the points
  double level = 0;                      ///< what records call the noise
  int n_seeds = 1;                       ///< seeds 0..n_seeds - 1, each over all pairs
  int jobs = 1;                          ///< threads
  bool quiet = false;                    ///< no progress line
  std::filesystem::path folder;  ///< for files that an external estimator leaves; empty: it leaves none
  bool rescore = false;          ///< of such files that are there already; no program is run
  RunJournal* journal =
      nullptr;           ///< sources that are in it are not run again; those that are done go into it
  PairObserver on_pair;  ///< of the first seed; may be empty
};

/// Puts a run on a procedure (plan.h): its options for the estimator go below those of the run, and,
/// where asked for, its noise and level replace the run's.
void follow_procedure(const std::string& name, bool with_noise, RunConfig& config);

/// What decides the records: sources, estimator and every option with its value. Equal configurations on
/// equal data give equal records.
Json resolved_configuration(const RunConfig& config);

/// Of its estimator, where that is no part of Sextant: as it is now, or, where it is scored again, as it ran.
/// Throws Error.
Fingerprints run_fingerprints(const RunConfig& config);

struct SourceRun {
  std::string source;  ///< as given
  SequenceInfo info;
  Trajectory truth;
  CaseMotions motions;                ///< of the first seed
  std::vector<BodyTrack> tracks;      ///< of the first seed
  Json noise;                         ///< requested and achieved, over all seeds; null without noise
  std::vector<std::string> problems;  ///< of the estimator, over all seeds
  std::map<std::string, InputLog::Entry> inputs;
};

struct RunResult {
  std::vector<Record> records;  ///< by source, seed, frame, ego first, then objects by id
  std::vector<SourceRun> sources;
  Json configuration;         ///< resolved_configuration()
  Fingerprints fingerprints;  ///< run_fingerprints(), before the first case
  double wall_time_s = 0;
  int jobs = 1;
};

/// What folders of a source are called: "<dataset>_<sequence>_<first>-<last>".
std::string folder_name(const SequenceInfo& info);

/// Throws Error on bad input, Interrupted on Ctrl-C.
RunResult run(const RunConfig& config);

// ---- the files of a run

/// records.jsonl, run.json and, per source, est_camera_{kitti,tum}.txt and obj_<id>_motion.txt; with more
/// than one source these lie in a subfolder each.
///   est_camera_kitti.txt  12 values a line: rows of [R|t] of T_world_camera
///   est_camera_tum.txt    t tx ty tz qx qy qz qw, t = frame / rate (s)
///   gt_camera_tum.txt     the same of the truth, over the frames of the source that have it
///   tracks.csv            camera and objects in the world, estimated and true (tracks.h)
///   obj_<id>_motion.txt   frame k, then 12 values of H_world of the pair (k-1, k) (m)
OutputFiles run_files(const RunResult& result);

/// build_provenance(), configuration and inputs of a run.
Json run_provenance(const RunResult& result);

// ---- What a run has done, so that the same run goes on after it: `sextant run` killed and started again
// gives the same bytes (times apart). The unit is a source, over all its seeds, which share one decoding of
// its frames.
//
//   DIR/unfinished.jsonl   a block per source that is done (records/journal.h); gone when the results are
//                          there
//
// A block counts for the same program, configuration and estimator only, and while every file that the source
// read is as it was.

/// What a source gave, over all seeds; motions and tracks are those of the first.
struct SourceOutcome : CaseOutcome {
  std::map<std::string, InputLog::Entry> inputs;
};

/// Files that were read: path -> {"bytes", "sha256"}.
Json inputs_json(const std::map<std::string, InputLog::Entry>& inputs);
/// Whether all of them still are as inputs_json() says.
bool same_inputs(const Json& inputs);

class RunJournal {
 public:
  /// Of the run of `configuration` (resolved_configuration(), and what fingerprints its estimator has) into
  /// `folder`, which is made with the first block.
  RunJournal(std::filesystem::path folder, const Json& configuration);

  /// Nothing where the source is not done, or would not give the same any more.
  std::optional<SourceOutcome> find(size_t source) const;
  void append(size_t source, const SourceOutcome& outcome);
  /// The results are in place.
  void remove();

 private:
  void open();

  std::filesystem::path path_;
  std::string owner_;
  std::optional<Journal> journal_;
};

}  // namespace sextant
