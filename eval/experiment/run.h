#pragma once

// Runs one estimator over sources and compares with their ground truth. Per source, in windows of frames
// (bounded memory): decode every frame once and extract the pairs' points, in parallel; then the sequential
// pipeline over the pairs; then records. The outcome does not depend on `jobs`, times excepted. Nothing is
// written here: see output.h.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"

namespace sextant {

/// Called after each pair of the first seed, in order, with the pipeline's own result and the pair's records.
using PairObserver = std::function<void(const FrameResult&, const std::vector<Record>&)>;

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
  PairObserver on_pair;          ///< may be empty
};

/// The options tree, read and completed with defaults.
struct ResolvedOptions {
  ExtractionOptions extraction;
  PipelineOptions pipeline;
  Json estimator = Json::object();
  Json source = Json::object();
};

/// Throws Error on an unknown key anywhere above "estimator" and "source"; those two are read by their
/// owners.
ResolvedOptions resolve_options(const Json& tree);

/// What decides the records: sources, estimator and every option with its value. Equal configurations on
/// equal data give equal records.
Json resolved_configuration(const RunConfig& config);

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
  double wall_time_s = 0;
  int jobs = 1;
};

/// Throws Error unless a source has two frames, images, depth, flow and masks, and every file of them.
void check_runnable(const SourceSpec& spec, const Sequence& sequence);

/// Throws Error on bad input, Interrupted on Ctrl-C.
RunResult run(const RunConfig& config);

}  // namespace sextant
