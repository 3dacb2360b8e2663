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
#include "sextant/eval/experiment/record.h"
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
    FrameResult result;
    std::vector<Record> records;  ///< ego first, then objects by id
  };
  /// The next pair; in order.
  Outcome process(const ExtractedPair& extracted);

  const CaseMotions& motions() const { return motions_; }
  const NoiseVerification& achieved_noise() const { return achieved_; }
  /// Of the estimator, PairSolver::problems().
  std::vector<std::string> problems() const;

 private:
  void extend_motions(const FrameResult& result);

  const Sequence& sequence_;
  CaseSettings settings_;
  Noise point_noise_;
  std::optional<Draws> draws_;          ///< with noise only
  std::unique_ptr<PairSolver> solver_;  ///< from the first pair on
  CaseMotions motions_;
  NoiseVerification achieved_;
};

}  // namespace sextant
