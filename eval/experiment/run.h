#pragma once

// Runs one estimator on sources and compares the results with their ground truth: a plan of one level, whose
// cases are the seeds. For each source, in windows of frames (bounded memory): decodes every frame once and
// extracts the pairs' points, in parallel; then processes the cases over the pairs (case_runner.h). The
// result does not depend on `jobs`, except for times. Nothing is written here: run_files() creates the files.

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"

namespace sextant {

class RunJournal;

struct RunConfig {
  std::vector<SourceSpec> sources;
  std::string estimator = "joint_flow";  ///< name for make_case_estimator()
  Json options = Json::object();         ///< strict tree: "extraction", "pipeline", "estimator", "source"
  Noise noise;                           ///< applied to masks before extraction, otherwise to the points
  double level = 0;                      ///< name of the noise in records
  int n_seeds = 1;                       ///< seeds 0..n_seeds - 1, each over all pairs
  int jobs = 1;                          ///< number of threads
  bool quiet = false;                    ///< no progress line
  std::filesystem::path folder;          ///< for files of an external estimator; empty: no files may be left
  bool rescore = false;                  ///< reads the files in `folder` again; no program is run
  /// Sources with a valid block in the journal are not run again; finished sources are appended. May be null.
  RunJournal* journal = nullptr;
  PairObserver on_pair;  ///< observes the first seed; may be empty
};

/// Applies a procedure (plan.h) to a run: options that the run does not set take the values that the
/// procedure has for this estimator; with `with_noise`, the noise and level of the procedure replace those of
/// the run. Throws Error if the procedure or its entry for the estimator does not exist.
void follow_procedure(const std::string& name, bool with_noise, RunConfig& config);

/// Returns everything that determines the records: sources, estimator and every option with its value. Equal
/// configurations on equal data give equal records.
Json resolved_configuration(const RunConfig& config);

/// Returns the present fingerprint of an estimator that is not part of Sextant or, if its files are read
/// again (`rescore`), the fingerprints in the run.json of the run that wrote them; empty for Sextant's own
/// estimators, and if that run has no run.json yet. Throws Error if a file cannot be read.
Fingerprints run_fingerprints(const RunConfig& config);

struct SourceRun {
  std::string source;  ///< source as given
  SequenceInfo info;
  Trajectory truth;
  CaseMotions motions;                ///< motions of the first seed
  std::vector<BodyTrack> tracks;      ///< tracks of the first seed
  Json noise;                         ///< requested and achieved, over all seeds; null without noise
  std::vector<std::string> problems;  ///< problems of the estimator, over all seeds, and of the source
  std::map<std::string, InputLog::Entry> inputs;
};

struct RunResult {
  std::vector<Record> records;  ///< ordered by source, seed, frame; ego first, then objects by id
  std::vector<SourceRun> sources;
  Json configuration;         ///< resolved_configuration()
  Fingerprints fingerprints;  ///< run_fingerprints(), before the first case
  double wall_time_s = 0;
  int jobs = 1;
};

/// Returns the name for folders of a source: "<dataset>_<sequence>_<first>-<last>".
std::string folder_name(const SequenceInfo& info);

/// Return the name of the folder that keeps the files of an external program, in the subfolder `external` of
/// the results: of a seed of a run, and of a case of a sweep by PlanCase::number.
std::string case_folder(const SequenceInfo& info, uint64_t seed);
std::string case_folder(uint64_t number);

/// Runs the estimator. Throws Error on bad input, Interrupted on Ctrl-C.
RunResult run(const RunConfig& config);

// ---- the files of a run

/// Returns records.jsonl, run.json and, for each source, the following files; with more than one source they
/// are in one subfolder per source, folder_name().
///   est_camera_kitti.txt  per estimated pose 12 values, the rows of [R|t] of T_world_camera
///   est_camera_tum.txt    t tx ty tz qx qy qz qw, t = frame / rate (s)
///   gt_camera_tum.txt     the true poses in the same format, over the frames of the source that have one
///   tracks.csv            camera and objects in the world, estimated and true (tracks.h)
///   obj_<id>_motion.txt   frame k, then 12 values of H_world of the pair (k-1, k) (m)
OutputFiles run_files(const RunResult& result);

/// Returns the content of run.json: build_provenance(), configuration, inputs and times of a run.
Json run_provenance(const RunResult& result);

// ---- Journal of a run, with which an interrupted run continues: `sextant run` killed and started again
// gives the same bytes (except for times). The unit is a source over all its seeds, which share one decoding
// of its frames.
//
//   DIR/unfinished.jsonl   a block per finished source (records/journal.h); removed when the results exist
//
// A block is valid only for the same program, configuration and estimator, and only while every file that the
// source read is unchanged.

/// Results of a source over all seeds; motions and tracks are those of the first.
struct SourceOutcome : CaseOutcome {
  std::map<std::string, InputLog::Entry> inputs;
};

/// Returns the files that were read: path -> {"bytes", "sha256"}.
Json inputs_json(const std::map<std::string, InputLog::Entry>& inputs);
/// Returns true if all files of inputs_json() exist and have the SHA-256 stored there.
bool same_inputs(const Json& inputs);

class RunJournal {
 public:
  /// Opens the journal of the run of `configuration` (resolved_configuration(), and the fingerprints of its
  /// estimator) in `folder`, which is created with the first block.
  RunJournal(std::filesystem::path folder, const Json& configuration);

  /// Returns the stored results of a source; nullopt if the source is not finished, or if a file that it read
  /// has changed since.
  std::optional<SourceOutcome> find(size_t source) const;
  void append(size_t source, const SourceOutcome& outcome);
  /// Removes the journal, once the results are in place.
  void remove();

 private:
  void open();

  std::filesystem::path path_;
  std::string owner_;
  std::optional<Journal> journal_;
};

// ---- The options of a run as one tree: "extraction", "pipeline", "estimator", "source" and, on the command
// line, "noise".

/// Returns the tree given by `options` (JSON or @FILE), in which each "dotted.key=value" of `sets` has set
/// one value. Throws Error if the text is not a JSON object or an assignment is malformed.
Json options_tree(const std::string& options, std::span<const std::string> sets);

/// The options of a run, completed with defaults.
struct ResolvedOptions {
  ExtractionOptions extraction;
  PipelineOptions pipeline;
  Json estimator = Json::object();
  Json source = Json::object();
};

/// Reads a tree. Throws Error on an unknown key anywhere except below "estimator" and "source", which are
/// read by the estimator and the adapter.
ResolvedOptions resolve_options(const Json& tree);

/// Returns all keys that the tree may have with an estimator, without the keys `source.*` of the data set's
/// adapter. Throws Error on an unknown estimator.
std::vector<OptionHelp> run_options(const std::string& estimator);
/// Returns the keys of a plan that are documented as options.
std::vector<OptionHelp> plan_options();

}  // namespace sextant
