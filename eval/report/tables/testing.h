#pragma once

// Evidence for tests: a few records of every role, whose errors are simple numbers.

#include "sextant/eval/records/testing.h"
#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/tables/paper_table.h"
#include "sextant/eval/report/testing.h"

namespace sextant {

inline Record test_record(const std::string& dataset, const std::string& sequence,
                          const std::string& estimator, const std::string& body, int frame, uint64_t seed) {
  Record r = RecordOf{dataset, sequence, estimator, body, "none", 0, seed, frame};
  r.n_points = 100;
  // Grows with seed and frame, so that the values scatter.
  const double e = 0.01 * (1 + 0.1 * static_cast<double>(seed) + 0.01 * frame) * (body == "ego" ? 1 : 2);
  r.errors = {{"Et_m", e},
              {"ER_deg", 3 * e},
              {"epe_initial_px", 1},
              {"epe_refined_px", 0.5},
              {"epe_measured_x_px", 0.8},
              {"epe_initial_y_px", 0.3}};
  r.bound = {{"Et_m", 0.9 * e}, {"ER_deg", 2 * e}};
  r.values = {{"nees", 6}};
  r.time_ms = {{"total", 5}, {"start", 2}, {"refine", 1}};
  if (body == "ego") {
    r.values["step_gt_m"] = 1;
    r.values["step_floor_m"] = 0.05;
    r.values["lateral_floor_m"] = 0.01;
    r.values["rotation_floor_deg"] = 0.06;
    r.values["rotation_timing_floor_deg"] = 0.02;
    r.time_ms["extraction"] = 4;
  } else {
    r.errors["Ev_kmh"] = 2.5;
    r.values["distance_gt_m"] = 8.0 * (body.back() - '0');
    r.values["distance_m"] = 7;
    r.values["area_fraction"] = 0.06;
    r.values["dynamic"] = 1;
    r.values["dynamic_gt"] = 1;
    r.values["v_gt_kmh"] = 54;
  }
  return r;
}

/// Evidence of every role with `n_frames` pairs and `n_seeds` seeds (one seed for real data).
inline Evidence test_evidence(int first_frame = 1, int n_frames = 12, uint64_t n_seeds = 4) {
  Evidence evidence;
  evidence.published = paper().published;
  const auto add = [&](const std::string& name, PartRole role, const std::string& dataset,
                       const std::string& sequence, const std::vector<std::string>& estimators,
                       const std::vector<std::string>& bodies, uint64_t seeds,
                       const std::string& parameter = "", const std::vector<double>& levels = {0}) {
    EvidencePart part{name, role, {}, {}};
    for (const std::string& estimator : estimators) {
      for (const double level : levels) {
        for (uint64_t seed = 0; seed < seeds; ++seed) {
          for (int frame = first_frame; frame < first_frame + n_frames; ++frame) {
            for (const std::string& body : bodies) {
              part.records.push_back(test_record(dataset, sequence, estimator, body, frame, seed));
              part.records.back().level = level;
            }
          }
        }
      }
    }
    part.sweep = noise_sweep_of(parameter, part.records);
    evidence.parts.push_back(std::move(part));
  };
  const std::vector<std::string> two = {"motion_only", "joint_flow"};
  const std::vector<std::string> bodies = {"ego", "object:1", "object:2", "object:3"};
  add("sets", PartRole::sets, "synthetic", "s18", two, bodies, n_seeds);
  add("flow", PartRole::noise, "synthetic", "s18", two, bodies, n_seeds, "flow.scale", {0.5, 1});
  add("classification", PartRole::classification, "replay-vkitti1", "0002/clone", {"joint_flow"}, bodies,
      n_seeds);
  add("demo", PartRole::real, "vdo", "kitti_03_demo", {"joint_flow"}, {"ego", "object:1"}, 1);
  add("recorded", PartRole::recorded, "kitti", "0003", {"ORB-SLAM3"}, {"ego"}, 1);
  add("timing", PartRole::timing, "synthetic", "s18", two, bodies, 1);
  add("systems_run", PartRole::systems, "synthetic", "s18", {"joint_flow", "VDO_SLAM 9d33024.front"}, bodies,
      3);
  add("attribution", PartRole::attribution, "synthetic", "s18",
      {"motion_only > published code", "motion_only > kernel", "joint_flow > published code",
       "joint_flow > kernel", "motion_only on inliers", "motion_only on all", "joint_flow on inliers",
       "joint_flow on all"},
      bodies, n_seeds);
  return evidence;
}

}  // namespace sextant
