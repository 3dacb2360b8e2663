#pragma once

// Checks that the parts of a source agree with one another: poses with depth and flow, objects with masks,
// boxes and depth. Each is a pure function of the sampled data and gives one number that grows with the
// disagreement. docs/data-check.md says what each measures, and why its limits are where they are.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/eval/check/convention_data.h"

namespace sextant {

/// `note`: worth knowing, or not checkable; says nothing against the source.
enum class CheckOutcome { pass, suspect, fail, note };
constexpr Names<4> names_of(CheckOutcome) { return {"PASS", "SUSPECT", "FAIL", "note"}; }

/// The outcome of one check, before any cause is looked for.
struct Finding {
  std::string check;            ///< "static flow"
  std::optional<double> value;  ///< empty: not checkable, `message` says why
  double limit = 0;             ///< up to here it passes
  double fail_limit = 0;        ///< above it fails; between the two it is suspect
  std::string unit;
  int n = 0;            ///< what the value was taken over
  std::string counted;  ///< what n counts: "points", "objects", "steps", ...
  std::string message;  ///< may be empty
  bool sharp = false;   ///< ~0 for exact data: a hypothesis that brings it there is right

  bool checkable() const { return value.has_value(); }
  bool passes() const { return checkable() && *value <= limit; }
  bool fails() const { return checkable() && *value > fail_limit; }
  CheckOutcome outcome() const;
  /// The median of the values becomes the number; false without any.
  bool measure(const std::vector<double>& values);
  /// Itself, with the message "not checkable: " and why.
  const Finding& not_checkable(std::string_view why);
  /// How far from passing: <= 1 passes. 0 when not checkable.
  double ratio() const;
};

// ---- depth, flow and poses (flow_conventions.cc)

/// Background points moved by the true camera motion land where the flow says. Median residual, px.
Finding check_static_flow(const ConventionData& data);
/// The factor on depth with which the true camera steps explain the flow, and the mean's relative standard
/// error.
struct DepthFactor {
  double factor = 1;
  double error = 0;
  int n = 0;  ///< pairs; 0: not known
};
DepthFactor fit_depth_factor(const ConventionData& data);
/// How much more too large depth is at the sides of the image than in its middle (halves of the samples by
/// the length of their rays), as a share of what range along the ray in place of z would make it. 0: a plain
/// factor; 1: range. Empty: not known.
std::optional<double> range_share(const ConventionData& data);
/// The scale s that depth needs so that the true camera motion explains the flow. |s - 1|, %.
Finding check_depth_scale(const ConventionData& data);
/// Points on an object's mask, moved by the object's true motion. Median over objects, m at the object.
Finding check_object_flow(const ConventionData& data);
/// How much larger depth is (median of valid pixels) at the bottom of the image than in its middle.
Finding check_depth_order(const ConventionData& data);

// ---- objects (object_conventions.cc)

/// True boxes whose best fitting mask has another id than the track. Share, %.
Finding check_mask_ids(const ConventionData& data);
/// Mask's outline against the true 2-D box: median of the largest edge distance, % of the box.
Finding check_mask_boxes(const ConventionData& data);
/// Horizontal and vertical offset of the projected 3-D box from the 2-D box. |median|, m at the object.
Finding check_box_sideways(const ConventionData& data);
Finding check_box_upright(const ConventionData& data);
/// Depth on an object's mask against the surface of its true 3-D box. |median|, %.
Finding check_object_depth(const ConventionData& data);
/// Angle between an object's z axis and the way it moves in the world. Median, deg.
Finding check_heading(const ConventionData& data);

// ---- plausibility of each part alone (plausible_conventions.cc)

Finding check_camera_model(const ConventionData& data);    ///< worst deviation in units of its limit
Finding check_camera_path(const ConventionData& data);     ///< angle between displacement and z axis, deg
Finding check_repeated_poses(const ConventionData& data);  ///< steps with exactly the same pose, in motion
Finding check_speed(const ConventionData& data);           ///< the largest median speed, km/h
Finding check_times(const ConventionData& data);           ///< stamps' unevenness, % of a step

/// All of the above, in the order of the report.
std::vector<Finding> check_conventions(const ConventionData& data);

}  // namespace sextant
