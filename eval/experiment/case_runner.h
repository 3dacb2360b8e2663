#pragma once

// One case: the pairs of one source, in order, under one noise level and seed, through one estimator,
// compared with ground truth.
//
//   pair -> noise -> estimator -> records;   poses and object motions are accumulated on the way

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sextant/datasets/dataset.h"
#include "sextant/eval/experiment/case_estimator.h"
#include "sextant/eval/experiment/pair_reader.h"
#include "sextant/eval/records/record.h"
#include "sextant/noise/noise.h"

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

/// What a case leaves behind besides its records.
struct CaseMotions {
  Trajectory estimated;          ///< T_world_camera; ends at the first frame without an ego estimate
  bool starts_at_truth = false;  ///< the first pose is the true one; else the identity
  /// id -> frame k -> H_world of the estimate, pair (k-1, k)
  std::map<int, std::map<int, SE3>> objects;
};

class CaseRunner {
 public:
  /// `sequence` must live as long as this. Only its description and truth are used.
  CaseRunner(const Sequence& sequence, CaseSettings settings);

  struct Outcome {
    FrameResult result;  ///< of several, the first
    /// Of each result of the estimator, one after the other: ego first, then objects by id.
    std::vector<Record> records;
  };
  /// The next pair; in order.
  Outcome process(const ExtractedPair& extracted);

  /// Of several results, those of the first.
  const CaseMotions& motions() const { return results_.empty() ? start_ : results_.front().motions; }
  const NoiseVerification& achieved_noise() const { return achieved_; }
  /// Of the estimator, PairSolver::problems().
  std::vector<std::string> problems() const;

 private:
  struct Result {
    std::string label;  ///< in records
    std::unique_ptr<PairSolver> solver;
    CaseMotions motions;
  };
  void begin();

  const Sequence& sequence_;
  CaseSettings settings_;
  Noise point_noise_;
  std::optional<Draws> draws_;   ///< with noise only
  CaseMotions start_;            ///< before the first pair
  std::vector<Result> results_;  ///< from the first pair on
  NoiseVerification achieved_;
};

}  // namespace sextant
