#pragma once

// Results of `evaluate ego` as JSON. One run:
//
//   {"metric":"ape|rpe", "relation", "unit", "align", "delta","all_pairs" (rpe), "n",
//    "stats":{"rmse","mean","median","std","min","max","sse"}, "reference","estimate","name", "n_reference",
//    "frames":{"axes","inverse","body_from_camera":[[4x4]], and with ref_}, "up":[3], "n_to_align",
//    "time_offset":{"offset_s","interval":[low,high],"speed_correlation","rotation_correlation","n"},
//    "interpolation":{"max_gap_s","largest_gap_s","n_outside","n_in_longer_gaps"},
//    "n_estimate","n_matched", "umeyama_scale", "alignment":[[4x4]],
//    "per_frame":{"n","n_left_out","Et_m":{"mean",..},"ER_deg":{..},"ER_float_acos_deg":{..},
//                 "step_error_m":[3],"step_drift_m","step_floor_m", other floors of the truth},
//    "kitti_odometry":{"n","path_m","translation_percent","rotation_deg_per_m","by_length":[..]},
//    "rpe":[{"delta","n","stats"}] (several lengths; "n" and "stats" are then those of the first),
//    "nees":{"n","dof","mean","interval","consistent","position","rotation"} (covariances in the estimate),
//    "warnings":[{"code","text"}]}
//
// A value that does not exist is left out, and is never 0, NaN or null; "umeyama_scale" does not exist if
// one side stands still. With several runs, the object has "runs":[...] (one object as above each),
// "systems":[...] and "comparisons":[...] in addition to "metric" .. "all_pairs"; "n" and "stats" are then
// pooled over all runs of the first system. A comparison has "a","b","n_common","mean_difference",
// "stretches" (rpe) or "runs_a","runs_b" (ape), and "p" or "why_no_p".

#include <vector>

#include "sextant/eval/evaluation/ego_evaluation.h"

namespace sextant {

Json to_json(const ErrorStatistics& statistics);
Json ego_json(const std::vector<EgoResult>& runs, const EgoReference& reference, const EgoOptions& options);

}  // namespace sextant
