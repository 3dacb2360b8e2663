#pragma once

// Tables, a figure and the document of `evaluate ego`.

#include <vector>

#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// Table of the statistics of the requested relation, per run and, for several runs, pooled per system. With
/// `steps` also the means of the errors per frame and of KITTI odometry, but no sum of squares.
Table ego_error_table(const std::vector<EgoResult>& runs, const EgoReference& reference,
                      const EgoOptions& options, bool steps = false);
/// Relative errors over each of several lengths; without rows if a single length was requested.
Table ego_length_table(const std::vector<EgoResult>& runs, const EgoOptions& options);
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
