#pragma once

// Runs one estimator over sources and compares with their ground truth: a plan of one level, whose cases are
// the seeds. Per source, in windows of frames (bounded memory): decode every frame once and extract the
// pairs' points, in parallel; then the cases over the pairs (case_runner.h). The outcome does not depend on
// `jobs`, times excepted. Nothing is written here: run_files() makes the files.

#include <map>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/experiment/run_journal.h"
#include "sextant/eval/records/fingerprint.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"

namespace sextant {

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
  RunJournal* journal = nullptr;  ///< sources that are in it are not run again; those that are done go into it
  PairObserver on_pair;          ///< of the first seed; may be empty
};

/// The options tree, read and completed with defaults.
struct ResolvedOptions {
  ExtractionOptions extraction;
  PipelineOptions pipeline;
  Json estimator = Json::object();
  Json source = Json::object();
};

/// Throws Error on an unknown key anywhere above "estimator" and "source", which are read by their owners.
ResolvedOptions resolve_options(const Json& tree);

/// Puts a run on a procedure (plan.h): its options for the estimator go below those of the run, and,
/// where asked for, its noise and level replace the run's.
void follow_procedure(const std::string& name, bool with_noise, RunConfig& config);

/// What decides the records: sources, estimator and every option with its value. Equal configurations on
/// equal data give equal records.
Json resolved_configuration(const RunConfig& config);

/// Of its estimator, where that is no part of Sextant: as it is now, or, where it is scored again, as it ran. Throws Error.
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
  Json configuration;  ///< resolved_configuration()
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

}  // namespace sextant
