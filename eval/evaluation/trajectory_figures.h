#pragma once

// Figures of recorded camera paths against a reference: from above, and what changes along them.

#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/explorer.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Poses of one curve that a figure draws, at most about; further ones are thinned() and the caption says
/// so. Of several curves together 4 times as many.
inline constexpr size_t drawn_poses = 900;

/// Paths of all systems from above beside the reference, and each again, coloured by its error.
std::vector<Figure> path_figures(const EgoCurves& curves);

/// The error over time and over the path; position and angles with their errors; speed.
std::vector<Figure> along_figures(const EgoCurves& curves);

/// Paths and curves to walk through on the page. All poses up to explored_poses, then those that thinned()
/// keeps.
Explorer ego_explorer(const EgoCurves& curves);

/// curves/<name>.csv of the reference and each run: every pose, with a column for each quantity.
OutputFiles curve_files(const EgoCurves& curves);

}  // namespace sextant
