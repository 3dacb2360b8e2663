#pragma once

// Checks that the parts of a source agree with one another: poses with depth and flow, objects with masks,
// boxes and depth. Each is a pure function of the sampled data and gives one number that grows with the
// disagreement. docs/datasets.md says what each measures, and why its limits are where they are.

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/diagnosis/hypothesis.h"

namespace sextant {

// ---- The data of the convention checks: the truth of a sequence, and its depth, flow and masks on a coarse
// grid of pixels. A plain value: a hypothesis about a mistake is a change of a copy of it (diagnosis.h).
//
//   grid:  sample (i, j) stands at pixel (i step + step/2, j step + step/2)
//   flow:  the flow image of frame k belongs to the pair (k + flow_from) -> (k + flow_to)
//
// An absent channel is an empty image. Units: m, px; NaN = invalid.

struct GridFrame {
  Image<float> depth_m;
  Image<Flow> flow;
  Image<uint16_t> mask;
  std::map<int, MaskOutline> outlines;  ///< of the full image
};

struct ConventionData {
  StereoCamera camera;
  int width = 0;  ///< of the full images, px
  int height = 0;
  double rate_hz = 0;
  int step = 1;  ///< px between samples
  int first_frame = 0;
  std::vector<GridFrame> frames;  ///< first_frame, first_frame + 1, ...; empty images where not looked at
  int flow_from = 0;
  int flow_to = 1;
  std::string depth_kind;  ///< as in SequenceInfo
  SequenceTruth truth;
  TruthFloor floor;               ///< accuracy of the true camera motion, where the data set knows it
  std::map<int, double> times_s;  ///< stamps, where the source has them

  int last_frame() const { return first_frame + static_cast<int>(frames.size()) - 1; }
  bool has(int frame) const { return frame >= first_frame && frame <= last_frame(); }
  const GridFrame& at(int frame) const { return frames[static_cast<size_t>(frame - first_frame)]; }
  double pixel(int sample) const { return sample * step + step / 2; }  // NOLINT: whole pixels
};

/// Everything but the grids: `frames` has the right number of empty ones.
ConventionData make_convention_data(const Sequence& sequence);

/// The samples of one channel.
template <typename T>
Image<T> sample_grid(const Image<T>& image, int step) {
  const int from = step / 2;
  return image_of((image.width() - from + step - 1) / step, (image.height() - from + step - 1) / step,
                  [&](int i, int j) { return image(i * step + from, j * step + from); });
}

/// One sample of a flow image, with the depth and mask id at its starting point.
struct FlowSample {
  double u = 0, v = 0;  ///< px
  double z_m = 0;
  Flow flow;
  int id = 0;
};
/// The valid samples of flow image k, taken at frame k + flow_from; none where a channel is missing.
std::vector<FlowSample> flow_samples(const ConventionData& data, int k);

// ---- findings

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

// ---- Runs the convention checks and looks for the cause of what they find: every hypothesis of the table is
// undone in a copy of the data and the checks run again. A check that did not pass is put down to the
// hypothesis under which it passes, nothing else breaks, and all checks together are nearest to perfect; to
// several when they do equally well; else to "no known cause fits".
//
// A sharp check that passes is looked at as well: when undoing a mistake takes nearly all of its residual
// away, exact data have that mistake, however small the residual was.

struct Diagnosis {
  Finding finding;
  CheckOutcome outcome = CheckOutcome::pass;
  std::string cause;  ///< of a check that did not pass; else empty
};

std::vector<Diagnosis> diagnose(const ConventionData& data, int jobs);

/// The mistakes that people make with data sets' conventions and that make sense for these data: what the
/// report tells the user, and how the mistake is undone in sampled data. How to add one: a line in the table
/// of hypotheses.cc.
std::vector<Hypothesis<ConventionData>> hypotheses(const ConventionData& data);

}  // namespace sextant
