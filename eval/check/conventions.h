#pragma once

// Consistency checks of a source: poses with depth and flow, objects with masks, boxes and depth. Each check
// is a pure function of the sampled data and returns one number that increases with the inconsistency.
// docs/datasets.md explains what each check measures, and its limits.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/names.h"
#include "sextant/datasets/dataset.h"
#include "sextant/eval/diagnosis/hypothesis.h"

namespace sextant {

// ---- Data of the convention checks: the truth of a sequence, and its depth, flow and masks on a coarse grid
// of pixels. A value type: a hypothesis about a mistake changes a copy of the data (diagnosis/hypothesis.h).
//
//   grid:  sample (i, j) is at pixel (i step + step/2, j step + step/2)
//   flow:  the flow image of frame k belongs to the pair (k + flow_from) -> (k + flow_to)
//
// An absent channel is an empty image. Units: m, px; NaN = invalid.

struct GridFrame {
  Image<float> depth_m;
  Image<Flow> flow;
  Image<uint16_t> mask;
  std::map<int, MaskOutline> outlines;         ///< outlines in the full image
  std::shared_ptr<const Image<uint8_t>> gray;  ///< full image, shared by all copies; null: no image
};

struct ConventionData {
  StereoCamera camera;
  int width = 0;  ///< size of the full images, px
  int height = 0;
  double rate_hz = 0;
  int step = 1;  ///< px between samples
  int first_frame = 0;
  /// Frames first_frame, first_frame + 1, ...; frames that are not sampled have empty images.
  std::vector<GridFrame> frames;
  int flow_from = 0;
  int flow_to = 1;
  std::string depth_kind;  ///< as in SequenceInfo
  SequenceTruth truth;
  TruthFloor floor;               ///< accuracy of the true camera motion, if the data set knows it
  std::map<int, double> times_s;  ///< stamps, if the source has them

  int last_frame() const { return first_frame + static_cast<int>(frames.size()) - 1; }
  bool has(int frame) const { return frame >= first_frame && frame <= last_frame(); }
  const GridFrame& at(int frame) const { return frames[static_cast<size_t>(frame - first_frame)]; }
  double pixel(int sample) const { return sample * step + step / 2; }  // NOLINT: whole pixels
};

/// Returns the data of a sequence without the images: `frames` contains an empty GridFrame for each frame.
ConventionData make_convention_data(const Sequence& sequence);

/// Returns the grid samples of one channel.
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
/// Returns the samples of flow image k that have valid flow, and valid depth in frame k + flow_from; empty if
/// flow or depth is missing. Without a mask all ids are 0.
std::vector<FlowSample> flow_samples(const ConventionData& data, int k);

// ---- findings

/// `note`: information, or not checkable; no evidence against the source.
enum class CheckOutcome { pass, suspect, fail, note };
constexpr Names<4> names_of(CheckOutcome) { return {"PASS", "SUSPECT", "FAIL", "note"}; }

/// Result of one check, before a cause is searched for.
struct Finding {
  std::string check;            ///< "static flow"
  std::optional<double> value;  ///< nullopt: not checkable, for the reason in `message`
  double limit = 0;             ///< passes up to this value
  double fail_limit = 0;        ///< fails above this value; suspect between the two
  std::string unit;
  int n = 0;            ///< number of samples behind the value
  std::string counted;  ///< unit of n: "points", "objects", "steps", ...
  std::string message;  ///< may be empty
  /// The value is about 0 for exact data and above rounding, so a hypothesis that makes it about 0 is right.
  bool sharp = false;
  std::string cause;  ///< cause that the check itself determines; then no other cause is searched for
  /// Correct data can exceed the limit, as `message` explains: a mistake is named only if its correction
  /// makes another check pass as well.
  bool may_be_right = false;
  /// The value is computed with the size of a typical car, because the true sizes are unknown: a value that
  /// passes does not distinguish two causes.
  bool sizes_assumed = false;

  bool checkable() const { return value.has_value(); }
  bool passes() const { return checkable() && *value <= limit; }
  bool fails() const { return checkable() && *value > fail_limit; }
  CheckOutcome outcome() const;
  /// Sets the value to the median of the values; returns false for an empty list.
  bool measure(const std::vector<double>& values);
  /// Sets the message to "not checkable: " and the reason; returns itself.
  const Finding& not_checkable(std::string_view why);
  /// Returns the value divided by its limit, which passes up to 1; 0 if not checkable. If the limit is 0: 0
  /// for the value 0, otherwise 1 + value.
  double ratio() const;
};

/// The value of a check in one frame or for one object, and the value above which it fails.
struct CheckedPart {
  int number = 0;  ///< frame or id
  double value = 0;
  double fail_limit = 0;
};
struct CheckedParts {
  std::vector<CheckedPart> parts;
  std::string_view kind;    ///< "pairs, of frames": what the parts are, and their numbers
  std::string_view cause;   ///< "only some frames are wrong"
  std::string_view advice;  ///< "check their flow, depth and poses"
};
/// Replaces the result by that of single parts which contradict the others, because a median over all hides
/// them: parts above their limit of failure and five times the median of the others.
void find_wrong_parts(const CheckedParts& checked, Finding& finding);
/// Applies find_wrong_parts() to the medians of the objects with three values or more, unless the check fails
/// already. `values` is by id; an object contradicts the others above `fail_limit`.
void find_wrong_objects(const std::map<int, std::vector<double>>& values, double fail_limit,
                        Finding& finding);

// ---- depth, flow and poses (flow_conventions.cc)

/// Compares the positions of background points after the true camera motion with the flow. Median residual,
/// px; that of single pairs, which are named, if they contradict the others.
Finding check_static_flow(const ConventionData& data);
/// Share of the background points whose flow differs by more than 0.25 px from that of their depth after the
/// true camera motion, %. It is about 0 for exact depth and flow, and depth of another rendering exceeds it
/// where its median residual is below the limit of check_static_flow(). nullopt without such points.
struct DeviatingShare {
  double percent = 0;
  int n = 0;  ///< number of points
};
std::optional<DeviatingShare> deviating_share(const ConventionData& data);
/// Share of the background points with flow that is exactly (0, 0) although it should be longer than 1 px, %:
/// by depth and the true camera motion or, without these, by the median of the other flow of the image.
/// Missing estimates are often written so. nullopt without flow.
std::optional<DeviatingShare> empty_flow_share(const ConventionData& data);
/// Factor on depth for which the true camera steps explain the flow, and its relative standard error.
struct DepthFactor {
  double factor = 1;
  double error = 0;
  int n = 0;  ///< number of pairs; 0: not known
};
DepthFactor fit_depth_factor(const ConventionData& data);
/// Returns by how much more depth is too large at the sides of the image than in the middle (two halves of
/// the samples by the length of their rays), as a share of the difference that range along the ray in place
/// of z would make. 0: depth has a plain factor; 1: depth is range. nullopt without pairs that determine the
/// share.
std::optional<double> range_share(const ConventionData& data);
/// Determines the factor s on depth for which the true camera motion explains the flow. |s - 1|, %.
Finding check_depth_scale(const ConventionData& data);
/// Compares the positions of points on an object's mask, after the object's true motion, with the flow.
/// Median over objects, m at the object; that of single objects if they contradict the others.
Finding check_object_flow(const ConventionData& data);
/// Divides depth (median of valid pixels) at the bottom of the image by that in the middle. Median over
/// frames.
Finding check_depth_order(const ConventionData& data);
/// Replaces the verdict on a failed order by SUSPECT, for depth that agrees with flow and true poses: the
/// scene can have such an order.
void allow_depth_order(Finding& order);
// ---- images (image_conventions.cc)

/// Compares each image with the next one at the end of the flow: mean absolute difference of
/// the grey values, as a ratio to the difference at the same pixel. Median over pairs.
Finding check_image_flow(const ConventionData& data);

// ---- objects (object_conventions.cc)

/// Counts true boxes whose best fitting mask has another id than the track. Share of the boxes that a mask
/// fits, %; 100 % if no mask fits any box. 100 % if two tracks exchange their masks in successive frames.
Finding check_mask_ids(const ConventionData& data);
/// Compares the outline of each mask with the true 2-D box of its id: largest distance between their edges, %
/// of the box. 40 % quantile over boxes.
Finding check_mask_boxes(const ConventionData& data);
/// Horizontal and vertical offset of the projected 3-D box from the 2-D box. |median|, m at the object.
Finding check_box_sideways(const ConventionData& data);
Finding check_box_upright(const ConventionData& data);
/// Compares depth on an object's mask with the surface of its true 3-D box. |median ratio - 1|, %; that of
/// single near objects if they contradict the others.
Finding check_object_depth(const ConventionData& data);
/// Computes the angle between an object's z axis and its displacement in the world. Median, deg.
Finding check_heading(const ConventionData& data);
/// Counts flags ObjectTruth::moving that contradict the object's step in the world to the next frame: moving
/// below 1 cm, resting above 10 cm. Share of the flags, %.
Finding check_moving_flags(const ConventionData& data);

// ---- plausibility of the camera, poses and time stamps on their own (conventions.cc)

Finding check_camera_model(const ConventionData& data);  ///< worst deviation in units of its limit
Finding check_camera_path(const ConventionData& data);   ///< angle between displacement and z axis, deg
/// Counts poses of camera and objects that equal the pose before although the camera moves, and poses that
/// are the identity.
Finding check_repeated_poses(const ConventionData& data);
/// Compares each position in the world with that predicted at the velocity of the step before. Distance of
/// the first of the largest jumps of the camera, or of an object if the camera does not jump, m.
Finding check_jumps(const ConventionData& data);
Finding check_speed(const ConventionData& data);  ///< the largest median speed, km/h
Finding check_times(const ConventionData& data);  ///< largest deviation of a step from the median, %

/// Returns the cause of contradictions with the true camera poses if all of them are equal, although the flow
/// of most frames shows that the camera moved; otherwise an empty text.
std::string cause_in_equal_poses(const ConventionData& data);

/// Returns the frames whose image equals the one before although the flow shows motion.
std::vector<int> frames_with_repeated_image(const ConventionData& data);

/// Returns true if the background's flow from `frame` shows that the camera moved.
bool flow_shows_motion(const GridFrame& frame);

/// Deviations above this number of units are reported as "> 1000", because their size says no more than that.
inline constexpr double largest_shown = 1000;
/// Formats a deviation with three decimals, or as "> 1000".
std::string value_text(double value);

/// Formats "1, 3, 5": the first 10 frames, followed by ".." if there are more.
std::string frame_list(const std::vector<int>& frames);

/// Runs the checks above, in the order of the report.
std::vector<Finding> check_conventions(const ConventionData& data);

// ---- Search for the causes of failed checks: every hypothesis of the table is undone in a copy of the data,
// and the checks are repeated. A check that did not pass is attributed to the hypothesis under which it
// passes, no further check fails, and all checks together have the lowest penalty; to several hypotheses if
// they are equally good; otherwise to "no known cause fits". Checks that assume the sizes of objects have no
// penalty where they pass.
//
// A sharp check of five or more samples that passes with more than 0.2 % of its limit is analysed as well: if
// undoing a mistake removes more than 90 % of its residual, and leaves at least half of the samples, the data
// are exact and contain that mistake, and the check is reported as FAIL.

inline constexpr const char* no_known_cause = "no known cause fits";

struct Diagnosis {
  Finding finding;
  CheckOutcome outcome = CheckOutcome::pass;
  std::string cause;  ///< cause of a check that did not pass; otherwise empty
};

/// Returns the diagnosis of every check, in the order of check_conventions(). `jobs`: number of threads.
std::vector<Diagnosis> diagnose(const ConventionData& data, int jobs);

/// Returns the common mistakes with the conventions of data sets that apply to these data: the text for the
/// report, and the function that undoes the mistake in sampled data. To add one, write a line in the table of
/// hypotheses.cc.
std::vector<Hypothesis<ConventionData>> hypotheses(const ConventionData& data);

}  // namespace sextant
