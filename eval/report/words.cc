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
      {"pair",
       word_kind,
       "two consecutive frames (k-1, k) of a source. Motions are estimated and compared pair by pair; a pair is "
       "called by its current frame k",
       {"frame pair", "pairs"}},
      {"body",
       word_kind,
       "what moves rigidly: `ego`, the camera, or `object:ID`, ID being the id in the masks",
       {"object", "ego", "camera"}},
      {"source",
       word_kind,
       "where frames come from: `adapter:path[#sequence][@first-last]`",
       {"sequence", "dataset"}},
      {"truth",
       word_kind,
       "in a summary: pairs that have ground truth in both frames; of objects those that are not static by truth",
       {"ground truth", "n_truth"}},
      {"estimated",
       word_kind,
       "in a summary: those of the pairs with truth that have the status `ok`. Errors are over them",
       {"n_estimated"}},
      {"coverage",
       word_kind,
       "estimated / truth, in percent: how many of the pairs with truth have an estimate",
       {"coverage_percent"}},
      {"preset",
       word_kind,
       "a named choice of error definitions for one table: frame of object motions, truth of the speed, mean or RMSE. "
       "It changes what a summary shows, never the records",
       {"presets"}},
      {"record",
       word_kind,
       "one line of `records.jsonl`: what one estimator made of one body in one pair",
       {"records"}},
      {"case", word_kind, "one source under one noise level and seed through one estimator", {"cases"}},
      {"level", word_kind, "how strong the noise of a case is; the noise model says what the number means"},
      {"seed",
       word_kind,
       "number of one draw of the noise. Equal seeds give equal draws, whatever the estimator",
       {"seeds"}},
      {"plan", word_kind,
       "a file that names sources, estimators, noise levels and seeds: the cases of a sweep"},
      {"part", word_kind,
       "one sweep, run or evaluation that `sextant reproduce` makes; a folder below `parts`"},
      {"gate", word_kind,
       "a limit on distance or area, or the test for motion, that leaves an object out on purpose before it is estimated",
       {"gates"}},
      {"inlier",
       word_kind,
       "a point within `pipeline.start.inlier_threshold_px` of the motion with which the refinement begins",
       {"inliers", "agree", "outlier", "n_inliers"}},
      {"pose change error",
       word_kind,
       "`E = M̂⁻¹ M` of a motion M and its estimate: E_t is the length of its translation, E_R its rotation angle",
       {"motion error"}},
      {"EPE",
       word_kind,
       "end-point error of the flow: distance of a measured or refined flow vector to the true one, in px, mean over points",
       {"end-point error"}},
      {"floor",
       word_kind,
       "how far the ground truth itself is off, where the data set tells. An error below it says nothing",
       {"truth's floor"}},
      {"NEES", word_kind,
       "normalised estimation error squared, `e^T C⁻¹ e`: the error in units of the estimate's own covariance. 6 on "
       "average where covariances are right, more where they are too small"},
      {"bound",
       word_kind,
       "the least error that any unbiased estimator can have from these measurements under their noise (Cramér-Rao)",
       {"limit", "CRLB"}},
      {"efficiency", word_kind, "bound / RMS error: 1 is the best that an unbiased estimator can do"},
      {"95 % interval",
       word_kind,
       "where the mean lies: bootstrap over seeds; with one seed over stretches of frames",
       {"interval", "confidence interval"}},
      {"single runs",
       word_kind,
       "where 95 % of single runs lie, one draw of the noise each",
       {"run range", "single-run range"}},
      {"verdict",
       word_kind,
       "within: the published value, which is one run, lies in the range of single runs; outside: it does not. "
       "Claims: reproduced or not reproduced where the whole interval says so, else undecided. Partly: rows differ",
       {"within", "outside", "reproduced", "not reproduced", "undecided", "partly"}},
      {"not measured here", word_kind,
       "nothing was measured, for want of data; the row says which command would"},
      {"dynamic",
       word_kind,
       "an object that moves against the background. TP, FP, FN, TN count what was found against what is true",
       {"static"}},
      {"profile", word_kind,
       "errors of a source's flow or depth, measured and fitted, that can be injected as noise"},
      {"procedure", word_kind, "how somebody else estimates, as options of ours"},
      {"regressed", word_kind,
       "of `sextant compare`: an error or time grew by more than the policy allows, and the numbers prove it"},
      {"inconclusive", word_kind, "of `sextant compare`: worse, and too few cases or repetitions to prove it"},
      {"invalid", word_kind, "of `sextant compare`: the two are no results of the same thing"},
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
    fail("'{}' is explained nowhere: nearest are {}; `sextant explain` lists all", one_line(asked),
         fmt::join(nearest(wanted), ", "));
  return found;
}

}  // namespace sextant
