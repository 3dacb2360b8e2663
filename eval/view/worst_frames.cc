#include "sextant/eval/view/worst_frames.h"

#include <algorithm>

#include "sextant/eval/records/record.h"

namespace sextant {
namespace {

const BodyResult* result_of(const FrameResult& frame, const Record& record) {
  if (record.is_ego()) return &frame.ego;
  const auto it = std::ranges::find(frame.objects, body_order(record.body), &BodyResult::instance);
  return it == frame.objects.end() ? nullptr : &*it;
}

bool is_worse(const WorstFrame& a, const WorstFrame& b) {
  return a.Et_m > b.Et_m || (a.Et_m == b.Et_m && a.record.frame < b.record.frame);
}

}  // namespace

void WorstFrames::add(const FrameResult& result, std::span<const Record> of_pair) {
  if (of_pair.empty()) return;
  const Record& first = of_pair.front();
  OfSequence& sequence = sequences_[{first.dataset, first.sequence}];
  sequence.frames.insert(first.frame);
  for (const Record& record : of_pair) {
    if (record.estimator != first.estimator || record.status != Status::ok || !has_truth(record)) continue;
    const std::string key = record.is_ego() ? "Et_m" : preset_.object_key("Et_m");
    const BodyResult* body = result_of(result, record);
    if (body == nullptr || !record.errors.contains(key)) continue;
    std::vector<WorstFrame>& worst = sequence.bodies[body_order(record.body)];
    WorstFrame frame{record, {}, result.prev, record.errors.at(key)};
    const auto place = std::ranges::upper_bound(worst, frame, is_worse);
    if (place - worst.begin() >= static_cast<std::ptrdiff_t>(n_frames)) continue;
    frame.result = *body;
    worst.insert(place, std::move(frame));
    if (worst.size() > n_frames) worst.pop_back();
  }
}

bool WorstFrames::has_seen(const SequenceInfo& info) const {
  const auto sequence = sequences_.find({info.dataset, info.sequence});
  if (sequence == sequences_.end()) return false;
  const auto next = sequence->second.frames.upper_bound(info.first_frame);
  return next != sequence->second.frames.end() && *next <= info.last_frame;
}

const std::map<int, std::vector<WorstFrame>>& WorstFrames::of(const SequenceInfo& info) const {
  static const std::map<int, std::vector<WorstFrame>> none;
  const auto sequence = sequences_.find({info.dataset, info.sequence});
  return sequence == sequences_.end() ? none : sequence->second.bodies;
}

}  // namespace sextant
