#pragma once

// Quantities along recorded camera paths, one value for each matched pose, in the world of the reference
// after the alignment. Figures, pages and CSV files are made from these.
//
//   time      s since the reference's first stamp; without time stamps the frame number
//   path_m    length of the reference's path up to the pose
//   angles    R = R_v(yaw) R_b(pitch) R_c(roll) about the axes v, b, c of the world. Yaw is about v, the axis
//             that the plane of the figures leaves out; roll is about the first axis of that plane, or about
//             z if v is y. For a camera with z forward in a world with y down, and for a vehicle with x
//             forward in a world with z up, these are the usual yaw, pitch and roll. Full turns accumulate,
//             so curves are continuous
//   speed     distance to the previous pose divided by the time between both
//   gaps      a curve is interrupted at a time step longer than 10 times its median step

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/eval/evaluation/ego_evaluation.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/figure.h"

namespace sextant {

/// Plane of the world in which paths are drawn from above. `extent` leaves out --up, or the axis along which
/// the path extends least.
enum class ViewPlane { extent, xy, xz, yz };
constexpr Names<4> names_of(ViewPlane) { return {"extent", "xy", "xz", "yz"}; }

/// Indices of the axes drawn to the right and upwards, and of the axis left out; {0, 2, 1} for xz.
struct ViewAxes {
  int right = 0, up = 2, out = 1;
};
constexpr std::array<const char*, 3> axis_names = {"x", "y", "z"};

/// Returns the axes of `plane`; for ViewPlane::extent they are chosen from the positions. If two axes extend
/// less than 5 % of the largest, as for a straight road, the plane is xz (the ground in a camera's world), or
/// xy if the path extends most along y.
ViewAxes view_axes(ViewPlane plane, const std::vector<Eigen::Vector3d>& positions_m,
                   const std::optional<Eigen::Vector3d>& up = std::nullopt);

/// One curve. Every list has one value per pose, or is empty if the recording does not have the quantity.
struct TrajectoryCurve {
  std::string name;  ///< name in legends
  std::vector<double> time;
  std::vector<int> frame;  ///< frame number in the reference, or row if it has none
  std::vector<double> path_m;
  std::vector<Eigen::Vector3d> position_m;
  std::vector<Eigen::Vector3d> angles_deg;  ///< roll, pitch, yaw
  std::vector<double> speed;                ///< m/s, or m per frame; NaN at the first pose and after gaps
  // Compared with the reference; empty for the curve of the reference itself.
  std::vector<double> error;  ///< error of the requested relation; NaN if the pose has none
  std::vector<Eigen::Vector3d> position_error_m;  ///< estimate minus reference
  std::vector<Eigen::Vector3d> angle_error_deg;   ///< differences of the angles, in (-180, 180]
  std::vector<bool> begins;  ///< true at the first pose and at the first pose after each gap

  size_t size() const { return time.size(); }
};

/// The curves of a reference and of the runs that are compared with it.
struct EgoCurves {
  ViewAxes axes;
  bool has_time = false;      ///< `time` is in s; otherwise it holds frame numbers
  std::string error_title;    ///< "APE trans part [m]"
  TrajectoryCurve reference;  ///< all poses of the reference, also unmatched ones
  std::vector<TrajectoryCurve> runs;

  std::string time_title() const { return has_time ? "time [s]" : "frame"; }
  std::string speed_title() const { return has_time ? "speed [m/s]" : "speed [m a frame]"; }
};

/// Formats the title of the error axis, e.g. "APE trans part [m]".
std::string error_title(const EgoOptions& options);

EgoCurves ego_curves(const std::vector<EgoResult>& runs, const EgoReference& reference,
                     const EgoOptions& options, ViewPlane plane);

/// Selects about `most` poses to draw: the poses are divided into equally long groups, and each group keeps
/// its first pose and the poses with its smallest and largest error. The last pose and both ends of every gap
/// are kept as well. Returns all indices if there are no more than `most`.
std::vector<size_t> thinned(const TrajectoryCurve& curve, size_t most);

/// Selects the points to draw of a line: no point is further than `tolerance` from the line through the
/// selected ones (Douglas and Peucker, 1973). Both ends of every gap are kept; begins[i] is true at the first
/// point after a gap.
std::vector<size_t> simplified(const std::vector<Eigen::Vector3d>& points, const std::vector<bool>& begins,
                               double tolerance);

// ---- Figures of recorded camera paths against a reference (trajectory_figures.cc): paths from above, and
// quantities along the path.

/// Approximate largest number of poses that a figure over time draws of one curve. All curves together have
/// about four times as many at most, or 60 each. Longer curves are reduced by thinned(), and the caption says
/// so. Paths are reduced by simplified(), to a distance that is not visible in print.
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
