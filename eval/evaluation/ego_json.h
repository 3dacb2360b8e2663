#pragma once

// Results of `evaluate ego` as JSON and as tables. The JSON of one run:
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
// A value that does not exist is left out, and is never 0, NaN or null. With several runs, the object has
// "runs":[...] (one object as above each), "systems":[...] and "comparisons":[...] in addition to "metric" ..
// "all_pairs"; "n" and "stats" are then pooled over all runs of the first system. A comparison has "a","b",
// "n_common","mean_difference", "stretches" (rpe) or "runs_a","runs_b" (ape), and "p" or "why_no_p".

#include <vector>

#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/table.h"

namespace sextant {

Json to_json(const ErrorStatistics& statistics);
Json ego_json(const std::vector<EgoResult>& runs, const EgoReference& reference, const EgoOptions& options);

/// Table of the statistics of the requested relation, per run and, for several runs, pooled per system. With
/// `steps` also the means of the errors per frame and of KITTI odometry, but no sum of squares.
Table ego_error_table(const std::vector<EgoResult>& runs, const EgoReference& reference,
                      const EgoOptions& options, bool steps = false);
/// Relative errors over each of several lengths; without rows if a single length was requested.
Table ego_length_table(const std::vector<EgoResult>& runs, const EgoOptions& options);
/// RMSE and median of the relative errors over the length, one line per run.
Figure ego_length_figure(const std::vector<EgoResult>& runs, const EgoOptions& options);
/// NEES of the runs that have covariances; without rows if none has.
Table ego_consistency_table(const std::vector<EgoResult>& runs);
/// Table of the errors per frame and of the KITTI odometry errors, one row per run.
Table ego_step_table(const std::vector<EgoResult>& runs, const EgoReference& reference);
/// Paired comparisons of systems; without rows for a single system.
Table ego_comparison_table(const std::vector<EgoResult>& runs, const EgoOptions& options);

/// Makes the report: paths and errors along them, the tables, the distribution of errors (cumulative per
/// system with its runs pooled, and a box per run), and the warnings. `curves` belong to the same runs.
ReportDocument ego_document(const std::vector<EgoResult>& runs, const EgoReference& reference,
                            const EgoOptions& options, const EgoCurves& curves);

}  // namespace sextant
