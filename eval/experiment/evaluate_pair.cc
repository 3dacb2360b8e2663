#include "sextant/eval/experiment/evaluate_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "sextant/base/error.h"
#include "sextant/geometry/object_motion.h"
#include "sextant/metrics/crlb.h"
#include "sextant/metrics/definitions.h"
#include "sextant/metrics/pair_errors.h"

namespace sextant {
namespace {

/// Ground truth of one object over the pair, as far as known.
struct ObjectStep {
  SE3 T_curr_prev;
  SE3 T_camera_object_prev;
  bool interpolated = false;
  std::optional<bool> flag;  ///< the data set's own dynamic/static flag, previous frame
};

/// Returns the step of an object with a true pose in both frames. Its motion T_curr_prev is T_camera_object
/// at `curr` times the inverse of T_camera_object at `prev`.
std::optional<ObjectStep> object_step(const SequenceTruth& truth, int id, int prev, int curr) {
  const std::optional<SE3> motion = truth.object_motion(id, prev, curr);
  if (!motion) return std::nullopt;
  const ObjectTruth& before = *truth.find(prev, id);
  const ObjectTruth& after = *truth.find(curr, id);
  return ObjectStep{*motion, before.T_camera_object, before.interpolated || after.interpolated,
                    before.moving};
}

Record new_record(const FrameResult& result, const PairContext& context, std::string body) {
  Record record = context.identity;
  record.frame = result.curr;
  record.body = std::move(body);
  return record;
}

void add_body(const BodyResult& body, Record& record) {
  record.status = body.status;
  record.gate = body.gate;
  record.n_points = body.n_points;
  record.n_inliers = body.n_inliers;
  if (std::isfinite(body.estimate.condition)) record.values["condition"] = body.estimate.condition;
  if (body.split.sides) record.values["split_nees_sides"] = *body.split.sides;
  if (body.split.cells) record.values["split_nees_cells"] = *body.split.cells;
  if (body.split.sides && body.split.cells)
    record.values["split_nees"] = 0.5 * (*body.split.sides + *body.split.cells);
  if (body.expansion) {
    record.values["expansion_gap_m"] = body.expansion->gap_m;
    record.values["expansion_chi2"] = body.expansion->chi2;
  }
  record.time_ms["total"] = body.times.total_ms();
  record.time_ms["start"] = body.times.start_ms;
  record.time_ms["refine"] = body.times.refine_ms;
}

PointFlow flow_at(const FlowSamples& samples, const Correspondences& points) {
  PointFlow flow;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto x = static_cast<int>(std::lround(points.u[i]));
    const auto y = static_cast<int>(std::lround(points.v[i]));
    const Flow value = samples.at(x, y);
    flow.u.push_back(value.u);
    flow.v.push_back(value.v);
  }
  return flow;
}

void add_flow_error(const FlowError& error, const std::string& stage, Record& record) {
  record.errors["epe_" + stage + "_px"] = error.epe_px;
  record.errors["epe_" + stage + "_x_px"] = error.x_px;
  record.errors["epe_" + stage + "_y_px"] = error.y_px;
}

/// Adds the EPE of the measured flow over all points of an estimated body, and the EPE before and after
/// refinement over its inliers.
void add_epe(const BodyResult& body, const std::optional<SE3>& true_motion, const PairContext& context,
             Record& record) {
  const MotionEstimate& estimate = body.estimate;
  if (estimate.inliers.size() != body.points.size()) return;
  if (context.true_flow == nullptr && !true_motion) return;
  const bool given = context.true_flow != nullptr;
  const PointFlow all = given ? flow_at(*context.true_flow, body.points)
                              : induced_flow(context.camera, *true_motion, body.points);
  const FlowError measured = flow_error(body.points.flow_u, body.points.flow_v, all.u, all.v);
  if (measured.n > 0) add_flow_error(measured, "measured", record);
  const Correspondences points = body.points.subset(estimate.inliers);
  const auto of_inliers = [&](const std::vector<double>& values) {
    std::vector<double> chosen;
    for (size_t i = 0; i < values.size(); ++i)
      if (estimate.inliers[i] != 0) chosen.push_back(values[i]);
    return chosen;
  };
  const PointFlow truth{of_inliers(all.u), of_inliers(all.v)};
  const FlowError initial = flow_error(points.flow_u, points.flow_v, truth.u, truth.v);
  if (initial.n == 0) return;
  record.flow_truth = given ? "given" : "induced";
  add_flow_error(initial, "initial", record);
  if (estimate.refined_flow_u.size() != body.points.size()) return;
  const FlowError refined =
      flow_error(of_inliers(estimate.refined_flow_u), of_inliers(estimate.refined_flow_v), truth.u, truth.v);
  if (refined.n > 0) add_flow_error(refined, "refined", record);
}

Record evaluate_ego(const FrameResult& result, const PairContext& context,
                    const std::optional<SE3>& true_background) {
  Record record = new_record(result, context, "ego");
  add_body(result.ego, record);
  record.values["start_propagated"] = result.ego.start_propagated ? 1 : 0;
  if (true_background) {
    const SE3 T_prev_curr = true_background->inverse();
    record.values["step_gt_m"] = T_prev_curr.translation().norm();
    if (const auto floor_m = context.truth.camera_step_floor_m) record.values["step_floor_m"] = *floor_m;
    record.values["rotation_gt_deg"] = rotation_angle_rad(T_prev_curr.rotation()) * 180.0 / std::numbers::pi;
  }
  if (result.ego.status != Status::ok) return record;
  const SE3 T_prev_curr = result.ego.estimate.T_curr_prev.inverse();
  record.values["step_m"] = T_prev_curr.translation().norm();
  if (true_background) {
    const SE3 truth = true_background->inverse();
    put(pose_change_error(T_prev_curr, truth), "", record.errors);
    const Eigen::Vector3d step_error_m = T_prev_curr.translation() - truth.translation();
    record.values["step_error_x_m"] = step_error_m.x();
    record.values["step_error_y_m"] = step_error_m.y();
    record.values["step_error_z_m"] = step_error_m.z();
  } else {
    record.status = Status::no_truth;
  }
  add_epe(result.ego, true_background, context, record);
  return record;
}

/// Threshold for data sets without a dynamic/static flag: an object is dynamic if its true speed is above it
/// (m/s). The label box of a stationary object moves by up to about 0.05 m per frame through annotation and
/// pose errors, i.e. 0.5 m/s at 10 Hz.
constexpr double min_true_speed_mps = 1.0;

/// Adds the properties of a true object that need no estimate.
void add_object_truth(const ObjectStep& step, const std::optional<SE3>& true_background, double dt_s,
                      Record& record) {
  const Eigen::Vector3d origin_m = step.T_camera_object_prev.translation();
  record.values["distance_gt_m"] = origin_m.z();
  record.values["interpolated_gt"] = step.interpolated ? 1 : 0;
  if (true_background) {
    const SE3 H = object_motion_prev(*true_background, step.T_curr_prev);
    const double v_kmh = velocity_kmh(H, origin_m, dt_s);
    record.values["v_gt_origin_kmh"] = v_kmh;
    record.values["dynamic_gt"] = step.flag.value_or(v_kmh > min_true_speed_mps * kmh_per_mps) ? 1 : 0;
  } else if (step.flag) {
    record.values["dynamic_gt"] = *step.flag ? 1 : 0;
  }
}

/// Adds the estimator's properties of an instance, before any comparison.
void add_object_values(const BodyResult& body, Record& record) {
  if (body.area_fraction > 0) record.values["area_fraction"] = body.area_fraction;
  record.values["distance_m"] = body.distance_m;
  record.values["moving_share"] = body.moving_share;
  record.values["track"] = body.track;
  if (body.status != Status::lost && std::isfinite(body.moving_share))
    record.values["dynamic"] = body.is_dynamic ? 1 : 0;
  if (body.likelihood) {
    record.values["motion_sigmas"] = body.likelihood->statistic;
    record.values["detectable_kmh"] = body.likelihood->detectable_mps * kmh_per_mps;
  }
  if (body.status != Status::ok) return;
  // speed_mps and centroid_m: FrameEstimator::refine_object() (lib/estimator/pipeline.cc), which
  // CaseRunner::process() calls (case_runner.cc) before this evaluation.
  record.values["v_kmh"] = body.speed_mps * kmh_per_mps;
  record.values["start_propagated"] = body.start_propagated ? 1 : 0;
}

/// Adds the errors of the motion in the camera, world and body frames, and those of the speed. Needs v_kmh of
/// add_object_values() and v_gt_origin_kmh of add_object_truth().
void add_object_errors(const BodyResult& body, const ObjectStep& step, const FrameResult& result,
                       const std::optional<SE3>& true_background, const PairContext& context,
                       Record& record) {
  const SE3& X = body.estimate.T_curr_prev;
  put(pose_change_error(X, step.T_curr_prev), "", record.errors);
  if (!true_background) return;

  const std::optional<SE3> T_prev = context.estimated.pose(result.prev);
  const std::optional<SE3> T_curr = context.estimated.pose(result.curr);
  if (T_prev && T_curr) {
    const SE3 truth = world_motion(*context.truth.camera.pose(result.prev),
                                   *context.truth.camera.pose(result.curr), step.T_curr_prev);
    put(pose_change_error(world_motion(*T_prev, *T_curr, X), truth), "_world", record.errors);
  }

  const SE3 H_true = object_motion_prev(*true_background, step.T_curr_prev);
  if (result.ego.status == Status::ok) {
    const SE3 H = object_motion_prev(result.ego.estimate.T_curr_prev, X);
    const SE3& L = step.T_camera_object_prev;
    put(pose_change_error(body_motion(H, L), body_motion(H_true, L)), "_body", record.errors);
  }

  // Ev_kmh = |v_kmh - v_gt_kmh|, both speeds at the centroid of the points that the refinement used, whose
  // depths are measured (velocity_kmh() is defined in geometry/object_motion.h).
  const double v_kmh = record.values.at("v_kmh");
  const double v_gt_kmh = velocity_kmh(H_true, body.centroid_m, result.dt_s);
  record.values["v_gt_kmh"] = v_gt_kmh;
  record.errors["Ev_kmh"] = velocity_error_kmh(v_kmh, v_gt_kmh);
  record.errors["Ev_origin_kmh"] = velocity_error_kmh(v_kmh, record.values.at("v_gt_origin_kmh"));
}

Record evaluate_object(int id, const BodyResult* body, const FrameResult& result, const PairContext& context,
                       const std::optional<SE3>& true_background) {
  const std::optional<ObjectStep> step = object_step(context.truth, id, result.prev, result.curr);
  Record record = new_record(result, context, object_body(id));
  if (step) add_object_truth(*step, true_background, result.dt_s, record);
  if (body == nullptr) {
    record.status = Status::not_detected;
    return record;
  }
  add_body(*body, record);
  add_object_values(*body, record);
  if (body->status != Status::ok) return record;
  if (step) {
    add_object_errors(*body, *step, result, true_background, context, record);
  } else {
    record.status = Status::no_truth;
  }
  add_epe(*body, step ? std::optional<SE3>(step->T_curr_prev) : std::nullopt, context, record);
  return record;
}

/// Returns the instances of the result and the true objects with a pose in both frames.
std::set<int> all_ids(const FrameResult& result, const SequenceTruth& truth) {
  std::set<int> ids;
  for (const BodyResult& body : result.objects) ids.insert(body.instance);
  if (const auto it = truth.objects.find(result.prev); it != truth.objects.end()) {
    for (const ObjectTruth& object : it->second) {
      if (truth.find(result.curr, object.id) != nullptr) ids.insert(object.id);
    }
  }
  return ids;
}

const Correspondences& clean_points(const BodyResult& body, const FramePair& clean) {
  if (body.instance == 0) return clean.background;
  const auto object = std::ranges::find(clean.objects, body.instance, &ObjectObservation::instance);
  SEXTANT_CHECK(object != clean.objects.end());
  return object->points;
}

/// Returns `offered` without its noise.
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

/// Adds the NEES and the bounds to `records`, which are the records of `result`.
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
    // The errors of the two motions are independent, since no point belongs to both bodies.
    const SE3& L = context.truth.find(result.prev, body.instance)->T_camera_object;
    put(rms_error(transported(ego->previous_depth + object->previous_depth, (*X * L).inverse())), "_body",
        record.bound);
  }
}

bool overflows(const Record::Numbers::value_type& error) {
  return std::abs(error.second) > internal::largest_number;
}

/// Removes errors beyond every number of a record. Those of an object in the world, in its own frame and of
/// its speed contain the motion of the camera, so they can overflow although the object is estimated well,
/// and are left out. Other errors are those of an estimate that has diverged: of its record only the values
/// remain that depend on the truth alone, as for any failed estimate.
void remove_overflowing(Record& record) {
  constexpr std::array<std::array<std::string_view, 2>, 3> with_camera = {
      {{"Et_world_m", "ER_world_deg"}, {"Et_body_m", "ER_body_deg"}, {"Ev_kmh", "Ev_origin_kmh"}}};
  const auto of_estimate = record.errors.find("Et_m");
  if (of_estimate != record.errors.end() && !overflows(*of_estimate)) {
    for (const auto& names : with_camera) {
      const auto is_named = [&](const auto& error) {
        return std::ranges::count(names, error.first.str()) > 0;
      };
      if (std::ranges::any_of(record.errors, [&](const auto& e) { return is_named(e) && overflows(e); }))
        erase_if(record.errors, is_named);
    }
  }
  if (std::ranges::none_of(record.errors, overflows)) return;
  record.status = Status::diverged;
  record.errors.clear();
  record.flow_truth = "";
  erase_if(record.values, [](const auto& item) {
    const MetricDefinition* const metric = find_metric(NumberMap::values, item.first.str());
    return metric == nullptr || !metric->is(truth_only);
  });
}

}  // namespace

std::vector<Record> evaluate_pair(const FrameResult& result, const PairContext& context) {
  // T_curr_prev of the static background: the inverse of the camera's true motion.
  const std::optional<SE3> true_background = context.truth.background_motion(result.prev, result.curr);
  std::map<int, const BodyResult*> bodies;
  for (const BodyResult& body : result.objects) bodies[body.instance] = &body;

  std::vector<Record> records = {evaluate_ego(result, context, true_background)};
  for (const int id : all_ids(result, context.truth)) {
    const auto it = bodies.find(id);
    records.push_back(
        evaluate_object(id, it == bodies.end() ? nullptr : it->second, result, context, true_background));
  }
  add_limits(result, context, records);
  for (Record& record : records) {
    remove_overflowing(record);
    // Only finite numbers enter records, in memory as in files.
    for (Record::Numbers* numbers : {&record.errors, &record.values, &record.bound, &record.time_ms})
      erase_if(*numbers, [](const auto& item) { return !internal::is_number(item.second); });
  }
  return records;
}

}  // namespace sextant
