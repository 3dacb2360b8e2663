#include "sextant/eval/evaluation/ego_json.h"

#include "sextant/eval/report/run_summary.h"

namespace sextant {

namespace {

Json interval_json(const Interval& interval) { return Json::array({interval.low, interval.high}); }

Json per_frame_json(const PerFrameErrors& e, const EgoReference& reference) {
  Json json;
  json["n"] = e.Et_m.size();
  json["n_left_out"] = e.n_left_out;
  if (!e.Et_m.empty()) {
    json["Et_m"] = to_json(error_statistics(e.Et_m));
    json["ER_deg"] = to_json(error_statistics(e.ER_deg));
  }
  if (!e.ER_float_acos_deg.empty())
    json["ER_float_acos_deg"] = to_json(error_statistics(e.ER_float_acos_deg));
  if (const auto errors = step_errors(e.row, e.step_error_m)) {
    json["step_error_m"] = {errors->mean_m.x(), errors->mean_m.y(), errors->mean_m.z()};
    json["step_drift_m"] = errors->drift_m;
  }
  if (reference.step_floor_m) json["step_floor_m"] = *reference.step_floor_m;
  for (const auto& [key, value] : reference.floors) json[key] = value;
  return json;
}

void put_odometry_error(Json& json, const KittiOdometryError& e) {
  json["n"] = e.n;
  if (e.translation_percent) json["translation_percent"] = *e.translation_percent;
  if (e.rotation_deg_per_m) json["rotation_deg_per_m"] = *e.rotation_deg_per_m;
}

Json kitti_json(const KittiOdometryErrors& errors) {
  Json json;
  put_odometry_error(json, errors.all);
  json["path_m"] = errors.path_m;
  json["by_length"] = Json::array();
  for (const KittiOdometryError& e : errors.by_length) {
    if (e.n == 0) continue;
    Json row;
    row["length_m"] = e.length_m;
    put_odometry_error(row, e);
    json["by_length"].push_back(row);
  }
  return json;
}

Json matrix_json(const Eigen::Matrix4d& m) {
  Json json = Json::array();
  for (int i = 0; i < 4; ++i) json.push_back(Json::array({m(i, 0), m(i, 1), m(i, 2), m(i, 3)}));
  return json;
}

/// Writes the conversions applied to the poses of one side; writes nothing for a camera in opencv axes.
void put_frame(Json& json, const PoseFrame& frame, const std::string& prefix) {
  if (frame.is_default()) return;
  json["frames"][prefix + "axes"] = to_string(frame.axes);
  if (frame.inverse) json["frames"][prefix + "inverse"] = true;
  json["frames"][prefix + "body_from_camera"] = matrix_json(frame.matrix());
}

void put_metric(Json& json, const EgoOptions& options) {
  json["metric"] = options.rpe() ? "rpe" : "ape";
  json["relation"] = std::string(to_string(options.relation));
  json["unit"] = std::string(unit_of(options.relation));
  json["align"] = std::string(to_string(options.alignment));
  if (options.up) json["up"] = {(*options.up)[0], (*options.up)[1], (*options.up)[2]};
  if (options.n_to_align > 0) json["n_to_align"] = options.n_to_align;
  put_frame(json, options.estimate_frame, "");
  put_frame(json, options.reference_frame, "ref_");
  if (options.rpe()) {
    json["delta"] = options.rpe()->text();
    json["all_pairs"] = options.rpe()->all_pairs;
  }
}

void put_times(Json& json, const EgoResult& r, const EgoOptions& options) {
  if (r.offset) {
    json["time_offset"] = {{"offset_s", r.offset->offset_s},
                           {"interval", Json::array({r.offset->low_s, r.offset->high_s})},
                           {"speed_correlation", r.offset->speed_correlation},
                           {"rotation_correlation", r.offset->rotation_correlation},
                           {"n", r.offset->n}};
  }
  if (r.interpolation) {
    json["interpolation"] = {{"max_gap_s", *options.interpolate_max_gap_s},
                             {"largest_gap_s", r.interpolation->largest_gap_s},
                             {"n_outside", r.interpolation->n_outside},
                             {"n_in_longer_gaps", r.interpolation->n_in_longer_gaps}};
  }
}

void put_run(Json& json, const EgoResult& r, const EgoReference& reference, const EgoOptions& options) {
  json["n"] = r.errors.size();
  json["stats"] = to_json(r.statistics);
  json["reference"] = reference.side.name;
  json["estimate"] = r.file;
  json["name"] = r.name;
  json["n_reference"] = r.n_reference;
  json["n_estimate"] = r.n_estimate;
  json["n_matched"] = r.estimate.size();
  put_times(json, r, options);
  if (r.umeyama_scale) json["umeyama_scale"] = *r.umeyama_scale;
  json["alignment"] = matrix_json(r.alignment.ref_from_est.matrix());
  json["per_frame"] = per_frame_json(r.per_frame, reference);
  json["kitti_odometry"] = kitti_json(r.kitti);
  for (const ErrorsOverLength& over : r.by_length) {
    Json row = {{"delta", over.length.text()}, {"n", over.errors.size()}};
    if (over.statistics) row["stats"] = to_json(*over.statistics);
    json["rpe"].push_back(std::move(row));
  }
  if (r.consistency) {
    const TrajectoryConsistency& c = *r.consistency;
    json["nees"] = {{"n", c.n},
                    {"dof", c.dof},
                    {"mean", c.nees},
                    {"interval", interval_json(c.interval)},
                    {"consistent", c.is_consistent()},
                    {"position", c.position_nees}};
    if (c.rotation_nees) json["nees"]["rotation"] = *c.rotation_nees;
  }
  json["warnings"] = Json::array();
  for (const std::string& text : reference.warnings)
    json["warnings"].push_back({{"code", "repaired"}, {"text", text}});
  for (const DataWarning& w : r.warnings) json["warnings"].push_back({{"code", w.code}, {"text", w.text}});
}

Json system_json(const SystemSummary& s) {
  Json json = {{"system", s.name}, {"runs", s.n_runs}, {"n", s.n_errors}, {"stats", to_json(s.pooled)}};
  if (s.rmse_interval) json["rmse_interval"] = interval_json(*s.rmse_interval);
  if (s.mean_interval) json["mean_interval"] = interval_json(*s.mean_interval);
  return json;
}

Json comparison_json(const SystemComparison& c, const EgoOptions& options) {
  Json json = {{"a", c.a}, {"b", c.b}, {"n_common", c.n_common}};
  if (unit_of_errors(options) == IndependentUnit::blocks) {
    json["stretches"] = c.n_blocks;
  } else {
    json["runs_a"] = c.n_runs_a;
    json["runs_b"] = c.n_runs_b;
  }
  if (c.difference) json["mean_difference"] = *c.difference;
  if (c.p_corrected) {
    json["p"] = *c.p_corrected;
  } else {
    json["why_no_p"] = c.why_no_p;
  }
  return json;
}

}  // namespace

Json to_json(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"std", s.std},
          {"min", s.min},   {"max", s.max},   {"sse", s.sse}};
}

Json ego_json(const std::vector<EgoResult>& runs, const EgoReference& reference, const EgoOptions& options) {
  Json json;
  put_metric(json, options);
  if (runs.size() == 1) {
    put_run(json, runs.front(), reference, options);
    return json;
  }
  const std::vector<SystemSummary> systems = summarize_systems(run_errors(runs));
  json["n"] = systems.front().n_errors;
  json["stats"] = to_json(systems.front().pooled);
  json["systems"] = Json::array();
  for (const SystemSummary& s : systems) json["systems"].push_back(system_json(s));
  json["comparisons"] = Json::array();
  for (const SystemComparison& c : compare_systems(run_errors(runs), unit_of_errors(options)))
    json["comparisons"].push_back(comparison_json(c, options));
  json["runs"] = Json::array();
  for (const EgoResult& r : runs) {
    Json run = {{"system", r.system}};
    put_run(run, r, reference, options);
    json["runs"].push_back(std::move(run));
  }
  return json;
}

}  // namespace sextant
