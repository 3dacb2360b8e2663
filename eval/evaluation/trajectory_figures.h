#pragma once

// Figures of recorded camera paths against a reference: paths from above, and quantities along the path.

#include "sextant/eval/evaluation/trajectory_series.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Approximate largest number of poses that a figure draws of one curve. All curves together have about four
/// times as many at most, or 60 each. Longer curves are reduced by thinned(), and the caption says so.
inline constexpr size_t drawn_poses = 900;

/// Paths of all systems from above with the reference, first in the colours of the systems, then coloured by
/// the error.
std::vector<Figure> path_figures(const EgoCurves& curves);

/// Figures along the path: the error over time and over path length; position and angles with their errors;
/// speed.
std::vector<Figure> along_figures(const EgoCurves& curves);

/// Returns the interactive view of paths and curves for the page. It contains all poses if there are at most
/// explored_poses, otherwise those that thinned() keeps.
Explorer ego_explorer(const EgoCurves& curves);

/// Writes curves/<name>.csv for the reference and each run: every pose, with a column for each quantity.
OutputFiles curve_files(const EgoCurves& curves);

}  // namespace sextant
