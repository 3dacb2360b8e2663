#include "sextant/eval/experiment/case_runner.h"

#include <algorithm>
#include <iterator>

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

}  // namespace

CaseRunner::CaseRunner(const Sequence& sequence, CaseSettings settings)
    : sequence_(sequence), settings_(std::move(settings)), point_noise_(settings_.noise.without_masks()) {
  const SequenceInfo& info = sequence.info();
  if (!point_noise_.none()) draws_.emplace(settings_.seed, info.dataset, info.sequence);
  const std::optional<SE3> first = sequence.truth().camera.pose(info.first_frame);
  start_.starts_at_truth = first.has_value();
  start_.estimated.set(info.first_frame, first.value_or(SE3()));
}

void CaseRunner::begin() {
  std::vector<NamedSolver> solvers = settings_.estimator->begin(
      {sequence_, settings_.pipeline, settings_.noise, settings_.seed, settings_.folder, settings_.rescore});
  for (NamedSolver& named : solvers) {
    results_.push_back({settings_.estimator_label + (named.name.empty() ? "" : "." + named.name),
                        std::move(named.solver), start_});
  }
}

CaseRunner::Outcome CaseRunner::process(const ExtractedPair& extracted) {
  static const Trajectory none;
  if (results_.empty()) begin();
  std::optional<NoisyPair> noisy;
  if (draws_) {
    noisy = point_noise_.apply(extracted.pair, *draws_);
    achieved_.merge(noisy->achieved);
  }
  const SequenceInfo& info = sequence_.info();
  Outcome out;
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
    if (out.records.empty()) out.result = std::move(frame);
    std::ranges::move(records, std::back_inserter(out.records));
  }
  return out;
}

std::vector<std::string> CaseRunner::problems() const {
  std::vector<std::string> all;
  for (const Result& result : results_) std::ranges::move(result.solver->problems(), std::back_inserter(all));
  return all;
}

}  // namespace sextant
