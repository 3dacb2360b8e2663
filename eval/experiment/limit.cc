#include "sextant/eval/experiment/evaluate_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/metrics/crlb.h"

namespace sextant {
namespace {

const Correspondences& clean_points(const BodyResult& body, const FramePair& clean) {
  if (body.instance == 0) return clean.background;
  const auto object = std::ranges::find(clean.objects, body.instance, &ObjectObservation::instance);
  SEXTANT_CHECK(object != clean.objects.end());
  return object->points;
}

/// `offered` without its noise.
Correspondences exact_points(const Correspondences& offered, const Correspondences& clean) {
  SEXTANT_CHECK(offered.before_noise.size() == offered.size());
  Correspondences exact;
  exact.reserve(offered.size());
  for (size_t i = 0; i < offered.size(); ++i) {
    const size_t k = offered.before_noise[i];
    const bool current_depth = std::isfinite(offered.depth_curr[i]);
    exact.push_back(clean.u[k], clean.v[k], clean.depth[k], clean.flow_u[k], clean.flow_v[k],
                    current_depth ? clean.depth_curr[k] : std::numeric_limits<double>::quiet_NaN());
  }
  return exact;
}

std::optional<MotionBound> bound_of(const BodyResult& body, const SE3& true_T_curr_prev,
                                    const PairContext& context) {
  const bool was_offered = body.status != Status::gated && body.status != Status::lost;
  if (!body.noise || context.clean == nullptr || !was_offered) return std::nullopt;
  const Correspondences exact = exact_points(body.points, clean_points(body, *context.clean));
  return motion_bound(context.camera, exact, true_T_curr_prev, *body.noise);
}

void add_nees(const BodyResult& body, const SE3& true_T_curr_prev, Record& record) {
  if (body.status != Status::ok) return;
  const auto value = nees(body.estimate.T_curr_prev, body.estimate.covariance, true_T_curr_prev);
  if (value) record.values["nees"] = *value;
}

void add_bound(const MotionBound& bound, const SE3& transport, Record& record) {
  put(rms_error(transported(bound.previous_depth, transport)), "", record.bound);
  if (bound.both_depths) put(rms_error(transported(*bound.both_depths, transport)), "_both", record.bound);
}

}  // namespace

void add_limits(const FrameResult& result, const PairContext& context, std::vector<Record>& records) {
  const auto record_of = [&](Interned body) -> Record& {
    const auto record = std::ranges::find(records, body, &Record::body);
    SEXTANT_CHECK(record != records.end());
    return *record;
  };
  std::optional<MotionBound> ego;
  if (const auto X = context.truth.background_motion(result.prev, result.curr)) {
    add_nees(result.ego, *X, records.front());
    ego = bound_of(result.ego, *X, context);
    if (ego) add_bound(*ego, SE3(), records.front());
  }
  for (const BodyResult& body : result.objects) {
    const auto X = context.truth.object_motion(body.instance, result.prev, result.curr);
    if (!X) continue;
    Record& record = record_of(object_body(body.instance));
    add_nees(body, *X, record);
    const std::optional<MotionBound> object = bound_of(body, *X, context);
    if (!object) continue;
    add_bound(*object, X->inverse(), record);
    if (!ego) continue;
    // The two motions' errors are independent: no point belongs to both bodies.
    const SE3& L = context.truth.find(result.prev, body.instance)->T_camera_object;
    put(rms_error(transported(ego->previous_depth + object->previous_depth, (*X * L).inverse())), "_body",
        record.bound);
  }
}

}  // namespace sextant
