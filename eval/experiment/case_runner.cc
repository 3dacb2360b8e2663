#include "sextant/eval/experiment/case_runner.h"

#include "sextant/eval/experiment/evaluate_pair.h"
#include "sextant/metrics/pose_change.h"

namespace sextant {

CaseRunner::CaseRunner(const Sequence& sequence, CaseSettings settings)
    : sequence_(sequence), settings_(std::move(settings)), point_noise_(settings_.noise.without_masks()) {
  const SequenceInfo& info = sequence.info();
  if (!point_noise_.none()) draws_.emplace(settings_.seed, info.dataset, info.sequence);
  const std::optional<SE3> first = sequence.truth().camera.pose(info.first_frame);
  motions_.starts_at_truth = first.has_value();
  motions_.estimated.set(info.first_frame, first.value_or(SE3()));
}

CaseRunner::Outcome CaseRunner::process(const ExtractedPair& extracted) {
  static const Trajectory none;
  if (!solver_) {
    solver_ = settings_.estimator->begin(
        {sequence_, settings_.pipeline, settings_.noise, settings_.seed, settings_.folder});
  }
  Outcome out;
  if (draws_) {
    const NoisyPair noisy = point_noise_.apply(extracted.pair, *draws_);
    achieved_.merge(noisy.achieved);
    out.result = solver_->process(noisy.pair);
  } else {
    out.result = solver_->process(extracted.pair);
  }
  extend_motions(out.result);
  const SequenceInfo& info = sequence_.info();
  out.records = evaluate_pair(out.result,
                              {info.dataset, info.sequence, settings_.estimator_label, info.camera.left,
                               sequence_.truth(), motions_.starts_at_truth ? motions_.estimated : none,
                               extracted.true_flow ? &*extracted.true_flow : nullptr, settings_.noise.name(),
                               settings_.level, settings_.seed, draws_ ? &extracted.pair : nullptr});
  out.records.front().time_ms["extraction"] = extracted.extraction_ms;
  out.records.front().time_ms["decode"] = extracted.decode_ms;
  return out;
}

std::vector<std::string> CaseRunner::problems() const {
  return solver_ ? solver_->problems() : std::vector<std::string>{};
}

void CaseRunner::extend_motions(const FrameResult& result) {
  const std::optional<SE3> T_world_prev = motions_.estimated.pose(result.prev);
  if (result.ego.status != Status::ok || !T_world_prev) return;
  const SE3 T_world_curr = *T_world_prev * result.ego.estimate.T_curr_prev.inverse();
  motions_.estimated.set(result.curr, T_world_curr);
  for (const BodyResult& body : result.objects) {
    if (body.status != Status::ok) continue;
    motions_.objects[body.instance][result.curr] =
        world_motion(*T_world_prev, T_world_curr, body.estimate.T_curr_prev);
  }
}

}  // namespace sextant
