#include "sextant/eval/experiment/case_runner.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "sextant/base/interrupt.h"
#include "sextant/base/parallel_for.h"
#include "sextant/eval/experiment/case_diagnosis.h"
#include "sextant/eval/experiment/evaluate_pair.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {
namespace {

void extend_motions(const FrameResult& result, CaseMotions& motions) {
  const std::optional<SE3> T_world_prev = motions.estimated.pose(result.prev);
  if (result.ego.status != Status::ok || !T_world_prev) return;
  const SE3 T_world_curr = *T_world_prev * result.ego.estimate.T_curr_prev.inverse();
  motions.estimated.set(result.curr, T_world_curr);
  for (const BodyResult& body : result.objects) {
    if (body.status != Status::ok) continue;
    motions.objects[body.instance][result.curr] =
        world_motion(*T_world_prev, T_world_curr, body.estimate.T_curr_prev);
  }
}

class CaseRunner {
 public:
  CaseRunner(const Sequence& sequence, const CaseSettings& settings)
      : sequence_(sequence), settings_(settings), point_noise_(settings.noise.without_masks()) {
    const SequenceInfo& info = sequence.info();
    if (!point_noise_.none()) draws_.emplace(settings_.seed, info.dataset, info.sequence);
    const std::optional<SE3> first = sequence.truth().camera.pose(info.first_frame);
    start_.starts_at_truth = first.has_value();
    start_.estimated.set(info.first_frame, first.value_or(SE3()));
  }

  void process(const ExtractedPair& extracted, const PairObserver& on_pair);

  CaseOutcome finish() {
    for (const Result& result : results_) {
      std::ranges::move(result.solver->problems(), std::back_inserter(out_.problems));
      if (settings_.estimator->is_third_party())
        std::ranges::move(diagnose_case(result.motions, sequence_.truth(), result.label,
                                                result.solver->recorded_camera()),
                          std::back_inserter(out_.problems));
    }
    out_.motions = results_.empty() ? std::move(start_) : std::move(results_.front().motions);
    return std::move(out_);
  }

 private:
  struct Result {
    std::string label;  ///< in records
    std::unique_ptr<PairSolver> solver;
    CaseMotions motions;
  };

  /// At the first pair: an estimator may look at the whole sequence.
  void begin() {
    std::vector<NamedSolver> solvers =
        settings_.estimator->begin({sequence_, settings_.pipeline, settings_.noise, settings_.seed,
                                    settings_.folder, settings_.rescore});
    for (NamedSolver& named : solvers) {
      results_.push_back({settings_.estimator_label + (named.name.empty() ? "" : "." + named.name),
                          std::move(named.solver), start_});
    }
  }

  const Sequence& sequence_;
  const CaseSettings& settings_;
  Noise point_noise_;
  std::optional<Draws> draws_;  ///< with noise only
  CaseMotions start_;           ///< before the first pair
  std::vector<Result> results_;
  CaseOutcome out_;
};

void CaseRunner::process(const ExtractedPair& extracted, const PairObserver& on_pair) {
  static const Trajectory none;
  if (results_.empty()) begin();
  std::optional<NoisyPair> noisy;
  if (draws_) {
    noisy = point_noise_.apply(extracted.pair, *draws_);
    out_.noise.merge(noisy->achieved);
  }
  const SequenceInfo& info = sequence_.info();
  const size_t n_before = out_.records.size();
  std::optional<FrameResult> first;
  for (Result& result : results_) {
    FrameResult frame = result.solver->process(noisy ? noisy->pair : extracted.pair);
    extend_motions(frame, result.motions);
    std::vector<Record> records =
        evaluate_pair(frame, {info.dataset, info.sequence, result.label, info.camera.left, sequence_.truth(),
                              start_.starts_at_truth ? result.motions.estimated : none,
                              extracted.true_flow ? &*extracted.true_flow : nullptr, settings_.noise.name(),
                              settings_.level, settings_.seed, draws_ ? &extracted.pair : nullptr});
    Record& ego = records.front();
    ego.time_ms["extraction"] = extracted.extraction_ms;
    ego.time_ms["decode"] = extracted.decode_ms;
    result.solver->add_costs(frame.curr, ego);
    check_listed(records);
    std::ranges::move(records, std::back_inserter(out_.records));
    if (!first) first = std::move(frame);
  }
  if (on_pair) on_pair(*first, std::span(out_.records).subspan(n_before));
}

}  // namespace

std::vector<CaseOutcome> run_cases(const Sequence& sequence, const std::vector<CaseSettings>& cases,
                                   const NextPairs& next, int jobs, const PairObserver& on_pair) {
  std::vector<CaseRunner> runners;
  for (const CaseSettings& settings : cases) runners.emplace_back(sequence, settings);
  const auto n = static_cast<int>(runners.size());
  for (std::span<const ExtractedPair> pairs = next(); !pairs.empty(); pairs = next()) {
    parallel_for(n, n > 1 ? jobs : 1, [&](int i) {
      for (const ExtractedPair& pair : pairs) {
        check_interrupt();
        runners[static_cast<size_t>(i)].process(pair, i == 0 ? on_pair : PairObserver());
      }
    });
  }
  std::vector<CaseOutcome> outcomes;
  for (CaseRunner& runner : runners) outcomes.push_back(runner.finish());
  return outcomes;
}

}  // namespace sextant
