#pragma once

// One case: the pairs of one source, in order, under one noise level and seed, through one estimator,
// compared with ground truth.
//
//   pair -> noise -> estimator -> records;   poses and object motions are accumulated on the way

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/pair_reader.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/noise/noise.h"
#include "sextant/truth/truth.h"

namespace sextant {

struct CaseSettings {
  std::string estimator_label;  ///< in records
  std::shared_ptr<const CaseEstimator> estimator;
  PipelineOptions pipeline;
  Noise noise;       ///< pairs come with its mask models applied: they come before extraction
  double level = 0;  ///< in records
  uint64_t seed = 0;
  std::filesystem::path folder;  ///< CaseContext::folder
  bool rescore = false;          ///< CaseContext::rescore
};

struct CaseMotions {
  Trajectory estimated;          ///< T_world_camera; ends at the first frame without an ego estimate
  bool starts_at_truth = false;  ///< the first pose is the true one; else the identity
  /// id -> frame k -> H_world of the estimate, pair (k-1, k)
  std::map<int, std::map<int, SE3>> objects;
};

struct CaseOutcome {
  /// By pair; of each result of the estimator, one after the other: ego first, then objects by id.
  std::vector<Record> records;
  CaseMotions motions;                ///< of several results, of the first
  NoiseVerification noise;            ///< achieved on the points
  std::vector<std::string> problems;  ///< of the estimator, PairSolver::problems()
};

/// The next pairs, in order, valid until the next call; none at the end.
using NextPairs = std::function<std::span<const ExtractedPair>()>;

/// Called after each pair, in order, with the first result of the estimator and the records of all.
using PairObserver = std::function<void(const FrameResult&, std::span<const Record>)>;

/// Cases that share their pairs: each goes over them in order, several at a time. Of `sequence` only its
/// description and truth are used. `on_pair` (may be empty) sees the first case. Throws Interrupted on
/// Ctrl-C.
std::vector<CaseOutcome> run_cases(const Sequence& sequence, const std::vector<CaseSettings>& cases,
                                   const NextPairs& next, int jobs, const PairObserver& on_pair = {});

// ---- the paths of a run's camera and objects (records/tracks.h)

/// The camera first, then the objects of which a motion was estimated and a truth is known, by id.
std::vector<BodyTrack> body_tracks(const CaseMotions& motions, const SequenceTruth& truth,
                                   const SequenceInfo& info);

// ---- Checks the motions of a third-party estimator against the truth of its case: centimetres, inverse
// motions, another frame than the declared one (eval/diagnosis). The estimator never sees the truth or these
// texts.

/// One line for each diagnosis; `estimator` begins it. `recorded_camera`: the poses that the motions of the
/// camera are from, where there are such; quaternions in another order show in them alone.
std::vector<std::string> diagnose_case(const CaseMotions& motions, const SequenceTruth& truth,
                                       const std::string& estimator,
                                       const Trajectory* recorded_camera = nullptr);

}  // namespace sextant
