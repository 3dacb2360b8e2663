#include "sextant/eval/report/words.h"

#include <algorithm>
#include <cctype>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

constexpr const char* word_kind = "word";
constexpr const char* status_kind = "status";

std::vector<Word> own_words() {
  return {
      {"adapter", word_kind,
       "reader of one data set; the word before the colon of a source, such as `kitti`"},
      {"APE", word_kind,
       "absolute pose error of a trajectory: each pose against the true one, after an alignment",
       {"absolute pose error"}},
      {"baseline", word_kind,
       "of a stereo camera: the distance between its two cameras. Of the gate: the accepted result that "
       "new results are compared with"},
      {"bf", word_kind,
       "focal length times stereo baseline, in px m; depth = bf / disparity"},
      {"body", word_kind,
       "a rigidly moving body: `ego`, the camera, or `object:ID`, where ID is the id in the masks",
       {"object", "ego", "camera"}},
      {"bound", word_kind,
       "Cramér-Rao lower bound (CRLB): the smallest RMS error that any unbiased estimator can have from "
       "these measurements under their noise",
       {"limit", "CRLB"}},
      {"case", word_kind,
       "one combination of source, estimator, noise level and seed",
       {"cases"}},
      {"claim", word_kind,
       "a statement of the paper that the report tests",
       {"claims"}},
      {"correspondence cache", word_kind,
       "files that keep the point correspondences of a decoded source, so that a sweep decodes it once "
       "(`sextant cache`)",
       {"pack", "packs"}},
      {"coverage", word_kind,
       "estimated / truth, in percent: the share of the pairs with truth in which the body was "
       "estimated",
       {"coverage_percent"}},
      {"delta_d", word_kind,
       "standard deviation of the disparity error, in px; depth noise has the standard deviation z^2 / "
       "bf * delta_d"},
      {"dynamic", word_kind,
       "moving relative to the background. TP, FP, FN and TN count decisions against the truth; "
       "positive means dynamic",
       {"static"}},
      {"efficiency", word_kind,
       "bound / RMS error; 1 is the best that an unbiased estimator can reach"},
      {"EPE", word_kind,
       "end-point error of the flow: the distance of a measured or refined flow vector from the true "
       "one, in px, mean over points",
       {"end-point error"}},
      {"estimated", word_kind,
       "in a summary: the number of pairs with truth whose status is `ok`. Errors are taken over these "
       "pairs",
       {"n_estimated"}},
      {"estimator", word_kind,
       "a function that computes the motion of a body from its points in two frames",
       {"estimators"}},
      {"experiment", word_kind,
       "one run, sweep or evaluation that `sextant reproduce` makes, in a folder of its own below "
       "`parts`",
       {"part"}},
      {"floor", word_kind,
       "accuracy of the ground truth itself, where the data set allows to compute it. Errors below the "
       "floor carry no information",
       {"truth's floor"}},
      {"flow", word_kind,
       "optical flow: for each pixel of the previous frame its displacement to the current frame, in px"},
      {"gate", word_kind,
       "of a body: a limit on distance or area, or the test for motion, that excludes an object before "
       "it is estimated. Of a repository: the check against regressions",
       {"gates"}},
      {"inconclusive", word_kind,
       "verdict of `sextant compare`: worse, but with too few cases or repetitions to prove it"},
      {"inlier", word_kind,
       "a point within `pipeline.start.inlier_threshold_px` of the motion from which the refinement "
       "starts",
       {"inliers", "agree", "outlier", "n_inliers"}},
      {"invalid", word_kind,
       "verdict of `sextant compare`: the two results are not of the same experiment"},
      {"joint", word_kind,
       "estimation that refines the optical flow together with the motion"},
      {"level", word_kind,
       "strength of the noise of a case; the noise model defines the unit"},
      {"lever arm", word_kind,
       "vector from the camera to the point of the vehicle to which the poses of another sensor refer"},
      {"NEES", word_kind,
       "normalised estimation error squared, `e^T C⁻¹ e`, with the estimate's own covariance C. Its "
       "mean is 6 for a consistent estimator, and more where covariances are too small"},
      {"not measured here", word_kind,
       "no value, because the data are missing; the row names the command that would measure it"},
      {"pair", word_kind,
       "two consecutive frames (k-1, k) of a source, named after the current frame k. Motions are "
       "estimated and compared pair by pair",
       {"frame pair", "pairs"}},
      {"plan", word_kind,
       "a JSON file of sources, estimators, noise levels and seeds; it defines the cases of a sweep"},
      {"pose change error", word_kind,
       "`E = M̂⁻¹ M` of a motion M and its estimate M̂; E_t is the length of its translation, E_R its "
       "rotation angle",
       {"motion error"}},
      {"preset", word_kind,
       "a named choice of error definitions for a table: frame of object motions, truth of the speed, "
       "mean or RMSE. It changes a summary, never the records",
       {"presets"}},
      {"procedure", word_kind,
       "the settings of another group's estimation procedure, as options of this program"},
      {"profile", word_kind,
       "errors of a source's flow or depth, measured and fitted, which can be injected as noise"},
      {"record", word_kind,
       "one line of `records.jsonl`: the result of one estimator for one body in one pair",
       {"records"}},
      {"regressed", word_kind,
       "verdict of `sextant compare`: an error or time grew by more than the policy allows, and the "
       "data prove it"},
      {"RPE", word_kind,
       "relative pose error of a trajectory: error of the motion over a fixed number of frames, "
       "distance, or angle",
       {"relative pose error"}},
      {"scenario", word_kind,
       "an embedded scene that is rendered with exact depth, flow, masks and truth",
       {"scene"}},
      {"seed", word_kind,
       "number of a noise realisation. The same seed gives the same noise to every estimator",
       {"seeds"}},
      {"single runs", word_kind,
       "range that contains 95 % of single runs, each with one realisation of the noise",
       {"run range", "single-run range"}},
      {"source", word_kind,
       "input of a run: `adapter:path[#sequence][@first-last]`",
       {"sequence", "dataset"}},
      {"split-half consistency", word_kind,
       "agreement of two estimates of a body from disjoint halves of its points; it tests a covariance "
       "without truth (`--consistency`)"},
      {"status", word_kind,
       "outcome of a body in a pair: `ok`, or why there is no estimate"},
      {"sweep", word_kind,
       "all cases of a plan",
       {"sweeps"}},
      {"truth", word_kind,
       "in a summary: the number of pairs with ground truth in both frames; for objects without pairs "
       "that are static by truth",
       {"ground truth", "n_truth"}},
      {"verdict", word_kind,
       "`within`: the published value, a single run, lies in the range of single runs; `outside`: it "
       "does not. Claims are reproduced or not reproduced if the whole interval agrees, otherwise "
       "undecided; partly: rows differ",
       {"within", "outside", "reproduced", "not reproduced", "undecided", "partly"}},
      {"95 % interval", word_kind,
       "confidence interval of the mean, by bootstrap over seeds, or over blocks of frames if there is "
       "one seed",
       {"interval", "confidence interval"}},
  };
}

std::vector<Word> statuses() {
  return {
      {"ok", status_kind, "estimated; compared where truth exists"},
      {"no_truth", status_kind, "estimated; truth is missing in one of the two frames"},
      {"not_detected", status_kind, "truth in both frames, but no mask in either"},
      {"lost", status_kind, "a mask in one of the two frames only, or none of the points lands on the other"},
      {"diverged", status_kind, "the solver found no finite optimum"},
      {"too_few_points", status_kind, "fewer points or inliers than the options ask for"},
      {"collinear", status_kind,
       "all points, or all that agree, lie on a line in space: a turn about it cannot be seen"},
      {"at_infinity", status_kind,
       "no inverse depth differs from zero by three standard deviations: a translation cannot be seen"},
      {"no_parallax", status_kind,
       "the covariance leaves a direction open: a turn by more than 0.25 rad, or a translation by more than half the "
       "distance (standard deviations); turns and translations look alike, as for a small flat patch"},
      {"gated", status_kind, "left out on purpose: too far, too small, or classified static"},
  };
}

/// "[text](address)" as text.
std::string without_links(std::string text) {
  for (size_t close = text.find("]("); close != std::string::npos; close = text.find("](", close)) {
    const size_t open = text.rfind('[', close), end = text.find(')', close);
    if (open == std::string::npos || end == std::string::npos) break;
    text.erase(close, end + 1 - close).erase(open, 1);
    --close;
  }
  return text;
}

std::vector<Word> made() {
  std::vector<Word> words = own_words();
  std::ranges::move(statuses(), std::back_inserter(words));
  for (const MetricDefinition& m : metric_definitions()) {
    std::vector<std::string> others = {m.name, m.symbol};
    const std::string end = m.name.substr(m.stem().size());  // "_m"; of a number without unit a part of its name
    if (end == "_m" || end == "_deg" || end == "_kmh" || end == "_px") others.push_back(m.stem());
    words.push_back({fmt::format("{}.{}", to_string(m.map), m.name), "number",
                     fmt::format("{} [{}], {}: {}", m.symbol, m.unit, m.body == "both" ? "every body" : m.body,
                                 without_links(m.definition)),
                     std::move(others)});
  }
  for (const MetricPreset& p : metric_presets())
    words.push_back(
        {p.name, "preset",
         fmt::format("{}. Objects: {}, {}, {} against {}; {}", p.description, p.object_Et_key,
                     p.object_ER_key, p.velocity_key, p.velocity_truth_key, to_string(p.aggregate))});
  return words;
}

/// "split_nees", "Split NEES" -> "splitnees".
std::string plain(std::string_view word) {
  std::string text;
  for (const char c : word) {
    if (c != '_' && c != '-' && c != ' ')
      text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return text;
}

/// Few letters apart, but not most of the word.
std::vector<std::string> nearest(const std::string& wanted) {
  std::vector<std::pair<int, std::string>> near;
  for (const Word& word : all_words()) {
    int distance = edit_distance(wanted, plain(word.word));
    for (const std::string& other : word.others)
      distance = std::min(distance, edit_distance(wanted, plain(other)));
    near.emplace_back(distance, word.word);
  }
  std::ranges::stable_sort(near, {}, &std::pair<int, std::string>::first);
  near.resize(std::min<size_t>(near.size(), 3));
  std::vector<std::string> names;
  for (const auto& [distance, name] : near) names.push_back(name);
  return names;
}

}  // namespace

std::span<const Word> all_words() {
  static const std::vector<Word> words = made();
  return words;
}

std::vector<const Word*> explain(std::string_view asked) {
  const std::string wanted = plain(asked);
  std::vector<const Word*> found;
  const auto is_asked = [&](const std::string& name) { return plain(name) == wanted; };
  for (const Word& word : all_words()) {
    if (is_asked(word.word) || std::ranges::any_of(word.others, is_asked)) found.push_back(&word);
  }
  if (found.empty())
    fail("'{}' is an unknown term; similar terms: {}. `sextant explain` lists all terms", one_line(asked),
         fmt::join(nearest(wanted), ", "));
  return found;
}

}  // namespace sextant
