#pragma once

// Quantities along recorded camera paths, one value for each matched pose, in the world of the reference
// after the alignment. Figures, pages and CSV files are functions of these.
//
//   time      s since the reference's first stamp; without time stamps the frame number
//   path_m    length of the reference's path up to the pose
//   angles    R = R_v(yaw) R_b(pitch) R_c(roll) about the axes v, b, c of the world: yaw about the axis v that
//             the plane of the figures leaves out, roll about the first axis of that plane, or z where v is y.
//             This is yaw, pitch, roll of a camera with z ahead in a world with y down, and of a vehicle with x
//             ahead in a world with z up. Continuous: whole turns accumulate
//   speed     distance from the pose before divided by the time between both
//   gaps      a curve is interrupted where its step in time is more than 10 times its median step

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/eval/evaluation/ego_evaluation.h"

namespace sextant {

/// Plane of the world that a path from above shows; extent: all but the one along which the path extends
/// least, or --up.
enum class ViewPlane { extent, xy, xz, yz };
constexpr Names<4> names_of(ViewPlane) { return {"extent", "xy", "xz", "yz"}; }

/// Indices of the axes to the right, up, and left out: {0, 2, 1} for xz.
struct ViewAxes {
  int right = 0, up = 2, out = 1;
};
constexpr std::array<const char*, 3> axis_names = {"x", "y", "z"};

/// The axes of `plane`; of ViewPlane::extent for these positions. With extents of two axes below 5 % of the
/// largest, as of a straight road, the choice is xz (the ground of a camera's world), or xy where y is the
/// longest.
ViewAxes view_axes(ViewPlane plane, const std::vector<Eigen::Vector3d>& positions_m,
                   const std::optional<Eigen::Vector3d>& up = std::nullopt);

/// Lists are as long as `time`, or empty where the recording does not have the quantity.
struct TrajectoryCurve {
  std::string name;  ///< as legends print it
  std::vector<double> time;
  std::vector<int> frame;  ///< of the reference: its frame number, or its row
  std::vector<double> path_m;
  std::vector<Eigen::Vector3d> position_m;
  std::vector<Eigen::Vector3d> angles_deg;  ///< roll, pitch, yaw
  std::vector<double> speed;                ///< m/s, or m a frame; NaN at the first pose and behind gaps
  // Against the reference; all empty for the reference itself.
  std::vector<double> error;                      ///< of the requested relation; NaN where the pose has none
  std::vector<Eigen::Vector3d> position_error_m;  ///< estimate minus reference
  std::vector<Eigen::Vector3d> angle_error_deg;   ///< differences of the angles, in (-180, 180]
  std::vector<bool> begins;                       ///< the curve begins here, or anew behind a gap

  size_t size() const { return time.size(); }
};

struct EgoCurves {
  ViewAxes axes;
  bool has_time = false;      ///< time is in s, else frame numbers
  std::string error_title;    ///< "APE trans part [m]"
  TrajectoryCurve reference;  ///< of all its poses, also unmatched ones
  std::vector<TrajectoryCurve> runs;

  std::string time_title() const { return has_time ? "time [s]" : "frame"; }
  std::string speed_title() const { return has_time ? "speed [m/s]" : "speed [m a frame]"; }
};

/// "APE trans part [m]".
std::string error_title(const EgoOptions& options);

EgoCurves ego_curves(const std::vector<EgoResult>& runs, const EgoReference& reference,
                     const EgoOptions& options, ViewPlane plane);

/// Indices of at most about `most` poses: of each of the equally long groups of consecutive poses the first
/// and those of the smallest and largest error, besides the last pose and both ends of every gap. All where
/// there are no more than `most`.
std::vector<size_t> thinned(const TrajectoryCurve& curve, size_t most);

/// Largest distance of a position to the line through the positions that `kept` names, m.
double thinning_distance_m(const TrajectoryCurve& curve, const std::vector<size_t>& kept);

}  // namespace sextant
