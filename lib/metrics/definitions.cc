#include "sextant/metrics/definitions.h"

#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/names.h"

namespace sextant {

std::span<const MetricPreset> metric_presets() {
  static const std::vector<MetricPreset> presets = {
      {"paper",
       "as the paper states: object motion in the camera frame, mean over steps, same velocity formula",
       "Et_m", "ER_deg", "Ev_kmh", "v_gt_kmh", Aggregate::mean},
      {"multimot_code",
       "as the published code: object motion in the estimate's world, velocity truth from the box origin",
       "Et_world_m", "ER_world_deg", "Ev_origin_kmh", "v_gt_origin_kmh", Aggregate::mean},
      {"vdo_slam", "VDO-SLAM: object motion in the body frame, mean over steps, same velocity formula",
       "Et_body_m", "ER_body_deg", "Ev_kmh", "v_gt_kmh", Aggregate::mean, 2},
      {"dynosam_rme", "DynOSAM relative motion error: body frame, RMSE", "Et_body_m", "ER_body_deg",
       "Ev_origin_kmh", "v_gt_origin_kmh", Aggregate::rmse},
      {"dynosam_ame", "DynOSAM absolute motion error: world frame, RMSE", "Et_world_m", "ER_world_deg",
       "Ev_origin_kmh", "v_gt_origin_kmh", Aggregate::rmse},
  };
  return presets;
}

const std::string& MetricPreset::object_key(const std::string& metric) const {
  if (metric == "Et_m") return object_Et_key;
  if (metric == "ER_deg") return object_ER_key;
  if (metric == "Ev_kmh") return velocity_key;
  return metric == "v_gt_kmh" ? velocity_truth_key : metric;
}

bool MetricPreset::aggregates(const std::string& metric) const {
  return metric == "Et_m" || metric == "ER_deg" || metric == "Ev_kmh";
}

const MetricPreset& find_preset(std::string_view name) {
  return find_entry(metric_presets(), name, "metric preset");
}

std::span<const MetricDefinition> metric_definitions() {
  using enum NumberMap;
  using enum Better;
  static const std::vector<MetricDefinition> definitions = {
      // Poses.
      {"Et_m", errors, "both", "E_t", "m", 4, lower,
       "translation of the pose change error; objects: motion in the camera frame", in_summary | compared},
      {"ER_deg", errors, "both", "E_R", "deg", 4, lower,
       "rotation angle of the pose change error; objects: motion in the camera frame", in_summary | compared},
      {"Et_world_m", errors, "object", "E_t, world", "m", 4, lower,
       "translation of the pose change error of the object's motion in the world"},
      {"ER_world_deg", errors, "object", "E_R, world", "deg", 4, lower,
       "rotation of the pose change error of the object's motion in the world"},
      {"Et_body_m", errors, "object", "E_t, body", "m", 4, lower,
       "translation of the pose change error of the object's motion in its own frame"},
      {"ER_body_deg", errors, "object", "E_R, body", "deg", 4, lower,
       "rotation of the pose change error of the object's motion in its own frame"},
      {"Et_corrected_m", errors, "ego", "E_t, velocity-corrected truth", "m", 4, lower,
       "`Et_m` against a truth whose steps are as long as the measured speed says", recorded_only},
      {"Et_scaled_m", errors, "ego", "E_t, estimate scaled to the truth's path", "m", 4, lower,
       "`Et_m` of the estimate scaled to the truth (alignment `scale`)", recorded_only},
      {"step_m", values, "ego", "step", "m", 4, neither, "length of the estimated translation of the pair"},
      {"step_gt_m", values, "ego", "true step", "m", 4, neither, "length of the true translation of the pair",
       truth_only},
      {"step_floor_m", values, "ego", "floor of the truth", "m", 4, neither,
       "RMS error of the lengths of the true steps, where the data set allows to compute it; one number per "
       "sequence",
       truth_only},
      {"lateral_floor_m", values, "ego", "lateral floor of the truth", "m", 4, neither,
       "RMS of the component of the true steps across the heading, without the part that a lever arm "
       "explains",
       truth_only},
      {"rotation_floor_deg", values, "ego", "rotation floor of the truth", "deg", 4, neither,
       "RMS difference between the true rotations and the measured turn rates: an upper bound of the truth's "
       "error",
       truth_only},
      {"rotation_timing_floor_deg", values, "ego", "rotation floor of the truth, timing", "deg", 4, neither,
       "RMS error of the true rotations because samples are not taken exactly at the time of their images: a "
       "lower bound of the truth's error",
       truth_only},
      {"step_error_x_m", values, "ego", "step error, right", "m", 4, neither,
       "estimated minus true translation of the pair, `T_prev_curr`, to the right in the previous camera"},
      {"step_error_y_m", values, "ego", "step error, down", "m", 4, neither, "the same, down"},
      {"step_error_z_m", values, "ego", "step error, ahead", "m", 4, neither,
       "the same, ahead. The three components together have the length `Et_m`; their mean over pairs is the "
       "systematic error, printed below a run's summary if it exceeds three standard errors"},
      {"rotation_gt_deg", values, "ego", "true rotation", "deg", 4, neither,
       "angle of the true rotation of the pair", truth_only},
      {"start_propagated", values, "both", "start propagated", "0/1", 0, neither,
       "the refinement began at the propagated motion (1) or at RANSAC's (0)"},
      // Speeds.
      {"Ev_kmh", errors, "object", "E_v", "km/h", 2, lower, "absolute difference of v_kmh and v_gt_kmh",
       in_summary},
      {"Ev_origin_kmh", errors, "object", "E_v, origin", "km/h", 2, lower,
       "absolute difference of v_kmh and v_gt_origin_kmh"},
      {"v_kmh", values, "object", "v", "km/h", 2, neither,
       "`abs(t - (I - R) c) / dt` of the estimated `H = X_0⁻¹ X = (R, t)`; c = centroid of the "
       "points that the refinement used, previous camera coordinates",
       in_summary | beside_speed},
      {"v_gt_kmh", values, "object", "v_gt", "km/h", 2, neither,
       "the same formula with the true H at the **same** c", in_summary | beside_speed},
      {"v_gt_origin_kmh", values, "object", "v_gt, origin", "km/h", 2, neither,
       "the same formula with the true H at the origin of the true box: its displacement (published code)",
       truth_only},
      // Flow. No estimator can improve the errors of the measured flow.
      {"epe_measured_px", errors, "both", "EPE, all points", "px", 3, neither,
       "mean end-point error of the measured flow over all points"},
      {"epe_measured_x_px", errors, "both", "EPE x, all points", "px", 3, neither,
       "mean absolute horizontal error of the measured flow"},
      {"epe_measured_y_px", errors, "both", "EPE y, all points", "px", 3, neither,
       "mean absolute vertical error of the measured flow"},
      {"epe_initial_px", errors, "both", "EPE before", "px", 3, neither,
       "mean end-point error of the measured flow over the inliers", in_summary},
      {"epe_initial_x_px", errors, "both", "EPE x before", "px", 3, neither,
       "mean absolute horizontal error of the measured flow"},
      {"epe_initial_y_px", errors, "both", "EPE y before", "px", 3, neither,
       "mean absolute vertical error of the measured flow"},
      {"epe_refined_px", errors, "both", "EPE after", "px", 3, lower,
       "mean end-point error of the refined flow over the inliers", in_summary},
      {"epe_refined_x_px", errors, "both", "EPE x after", "px", 3, lower,
       "mean absolute horizontal error of the refined flow"},
      {"epe_refined_y_px", errors, "both", "EPE y after", "px", 3, lower,
       "mean absolute vertical error of the refined flow"},
      // Objects.
      {"distance_m", values, "object", "distance", "m", 2, neither,
       "median depth of the object's points, previous frame"},
      {"distance_gt_m", values, "object", "true distance", "m", 2, neither,
       "depth (z) of the true box's origin, previous camera frame", truth_only},
      {"area_fraction", values, "object", "area", "0..1", 4, neither,
       "share of the current image that the mask covers"},
      {"moving_share", values, "object", "moving share", "0..1", 2, neither,
       "share of points whose scene flow is above the threshold"},
      {"dynamic", values, "object", "dynamic", "0/1", 0, neither,
       "classified as moving; left out where no point has both depths"},
      {"motion_sigmas", values, "object", "motion", "sigma", 2, neither,
       "with `pipeline.classification.test=likelihood`: how far the body's displacement against the "
       "background lies beyond "
       "the smallest speed, in standard deviations of its covariance; dynamic above the quantile of the "
       "false alarm rate"},
      {"detectable_kmh", values, "object", "detectable", "km/h", 2, neither,
       "speed that this test detects in half of the cases, along its least observable direction"},
      {"dynamic_gt", values, "object", "truly dynamic", "0/1", 0, neither,
       "the data set's own flag where it has one, else `v_gt_origin_kmh` > 3.6 (1 m/s)", truth_only},
      {"interpolated_gt", values, "object", "interpolated truth", "0/1", 0, neither,
       "the truth of either frame was made by interpolation between labelled frames", truth_only},
      {"track", values, "object", "track", "label", 0, neither,
       "label of the pipeline's tracker, 0 = static or none"},
      // Consistency of the estimator's covariance.
      {"split_nees", values, "both", "split NEES", "1", 2, neither,
       "mean of `split_nees_sides` and `split_nees_cells`"},
      {"split_nees_sides", values, "both", "split NEES, sides", "1", 2, neither,
       "with `--consistency`: normalised square of the difference of two estimates from the left and the "
       "right half of the inliers, split at their median pixel: `e^T (C1 + C2 - C12 - C21)⁻¹ e`, `exp(e) = "
       "X̂1 X̂2⁻¹`; C12: their cross-covariance, from errors that correlate over the image. Needs no truth; "
       "its mean is 6 if the covariances are right"},
      {"split_nees_cells", values, "both", "split NEES, cells", "1", 2, neither,
       "the same from odd and even squares of 80 px"},
      {"expansion_gap_m", values, "object", "expansion gap", "m", 3, neither,
       "with `--consistency`: depth by which the current disparities put the object farther away than the "
       "motion estimated from flow and previous depth alone"},
      {"expansion_chi2", values, "object", "expansion chi2", "1", 2, neither,
       "square of this gap over its variance, with errors common to the whole object of 0.12 px of the flow "
       "and 0.16 px of the change of the disparity; its mean is 1 if flow and disparities agree"},
      {"nees", values, "both", "NEES", "1", 2, neither,
       "normalised error squared of the estimate: `e^T C⁻¹ e`, `exp(e) = X̂ X⁻¹`, C the estimator's own "
       "covariance"},
      {"condition", values, "both", "condition", "1", 0, neither,
       "condition number of the estimator's covariance of the twist (m, rad): largest over smallest "
       "eigenvalue; "
       "left out where there is no covariance"},
      {"peak_memory_mb", values, "ego", "memory", "1e6 bytes", 0, neither,
       "external programs: resident size of the largest process "
       "([external-estimators.md](external-estimators.md#in-the-records))"},
      // Cramer-Rao lower bounds.
      {"Et_m", bound, "both", "E_t bound", "m", 4, neither,
       "bounds the RMS of `errors.Et_m`, from flow and the **previous** frame's depth"},
      {"ER_deg", bound, "both", "E_R bound", "deg", 4, neither,
       "bounds the RMS of `errors.ER_deg`, from the same measurements"},
      {"Et_both_m", bound, "both", "E_t bound, both depths", "m", 4, neither,
       "as `Et_m`, if the current frame's depth were a measurement of the same point with the same noise"},
      {"ER_both_deg", bound, "both", "E_R bound, both depths", "deg", 4, neither,
       "as `ER_deg`, under the same assumption"},
      {"Et_body_m", bound, "object", "E_t bound, body", "m", 4, neither,
       "bounds the RMS of `errors.Et_body_m`; includes the error of the camera"},
      {"ER_body_deg", bound, "object", "E_R bound, body", "deg", 4, neither,
       "bounds the RMS of `errors.ER_body_deg`, likewise"},
      // Wall-clock times.
      {"start", time_ms, "both", "start", "ms", 2, lower, "robust start"},
      {"refine", time_ms, "both", "refine", "ms", 2, lower, "the estimator"},
      {"total", time_ms, "both", "total", "ms", 2, lower,
       "from the robust start to the end of the refinement; objects: gates and classification too"},
      {"extraction", time_ms, "ego", "extraction", "ms", 2, lower,
       "images to points, which the bodies of a pair share"},
      {"decode", time_ms, "ego", "decode", "ms", 2, lower,
       "reading the **previous** frame; each frame is decoded once"},
      {"cpu", time_ms, "ego", "cpu", "ms", 2, lower,
       "external programs: their processor time, divided by the number of pairs"},
      {"program", time_ms, "ego", "program", "ms", 2, lower,
       "external programs that report it: their own time of the pair"},
  };
  return definitions;
}

std::string MetricDefinition::stem() const { return name.substr(0, name.rfind('_')); }

std::string MetricDefinition::key(const std::string& statistic) const {
  return stem() + "_" + statistic + name.substr(stem().size());
}

const MetricDefinition* find_metric(NumberMap map, std::string_view name) {
  for (const MetricDefinition& d : metric_definitions()) {
    if (d.map == map && d.name == name) return &d;
  }
  return nullptr;
}

const MetricDefinition& metric(NumberMap map, std::string_view name) {
  const MetricDefinition* found = find_metric(map, name);
  SEXTANT_CHECK(found != nullptr);
  return *found;
}

std::vector<const MetricDefinition*> metrics_for(MetricUse use) {
  std::vector<const MetricDefinition*> found;
  for (const MetricDefinition& d : metric_definitions()) {
    if (d.is(use)) found.push_back(&d);
  }
  return found;
}

Json metric_definitions_json() {
  Json json = Json::object();
  for (const MetricDefinition& d : metric_definitions()) {
    if (d.map == NumberMap::errors && !d.is(recorded_only))
      json[d.name] = fmt::format("{}: {} [{}]", d.version, d.definition, d.unit);
  }
  return json;
}

Json metric_presets_json() {
  Json json = Json::object();
  for (const MetricPreset& p : metric_presets()) {
    json[p.name] = fmt::format("{}{}, {}, {} against {}, {}",
                               p.version == 1 ? "" : fmt::format("{}: ", p.version), p.object_Et_key,
                               p.object_ER_key, p.velocity_key, p.velocity_truth_key, to_string(p.aggregate));
  }
  return json;
}

}  // namespace sextant
