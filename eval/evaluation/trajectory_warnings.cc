#include "sextant/eval/evaluation/trajectory_warnings.h"

#include <algorithm>
#include <filesystem>

#include "sextant/base/error.h"
#include "sextant/eval/evaluation/trajectory_offset.h"

namespace sextant {
namespace {

bool has_any(const std::string& text, std::initializer_list<std::string_view> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return text.find(word) != std::string::npos; });
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Returns true if `word` stands in a file name separately, not within a longer word.
bool has_word(const std::string& name, std::string_view word) {
  const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
  for (size_t at = name.find(word); at != std::string::npos; at = name.find(word, at + 1)) {
    const size_t end = at + word.size();
    if ((at == 0 || !is_letter(name[at - 1])) && (end == name.size() || !is_letter(name[end]))) return true;
  }
  return false;
}

bool claims_truth(const TrajectorySide& side) {
  const std::string name = lower(std::filesystem::path(side.name).filename());
  return has_any(name, {"groundtruth", "ground_truth", "ground-truth"}) || has_word(name, "gt") ||
         has_any(side.comments, {"ground truth", "groundtruth"});
}

bool claims_estimate(const TrajectorySide& side) {
  const std::string name = lower(std::filesystem::path(side.name).filename());
  return !claims_truth(side) &&
         (has_word(name, "est") || has_any(name, {"estimate", "slam", "odometry", "keyframetrajectory"}));
}

}  // namespace

std::vector<TrajectoryWarning> warnings_of_pair(const PoseSeries& reference,
                                                const TrajectorySide& reference_side,
                                                const PoseSeries& estimate,
                                                const TrajectorySide& estimate_side) {
  std::vector<TrajectoryWarning> warnings;
  const bool by_name = (claims_truth(estimate_side) && !claims_truth(reference_side)) ||
                       (claims_estimate(reference_side) && !claims_estimate(estimate_side));
  if (by_name) {
    warnings.push_back(
        {"swapped", fmt::format("{} looks like the ground truth and {} like an estimate by their names "
                                "or comments: are they swapped? The reference comes first",
                                estimate_side.name, reference_side.name)});
  }
  const std::vector<double>&a = reference.stamps_s, &b = estimate.stamps_s;
  if (a.size() < 3 || b.size() < 3) return warnings;
  const double step_a = median_step(a), step_b = median_step(b);
  if (!(step_a > 0) || !(step_b > 0)) return warnings;
  for (const auto& [step, side] : {std::pair(step_a, &reference_side), std::pair(step_b, &estimate_side)}) {
    constexpr double shortest_s = 1e-5, longest_s = 1000;
    if (step >= shortest_s && step <= longest_s) continue;
    warnings.push_back({"clock", fmt::format("the time steps of {} are {:.3g} s: are its stamps seconds?",
                                             side->name, step)});
  }
  const double ratio = step_a / step_b;
  const bool longer = b.back() - b.front() > 1.02 * (a.back() - a.front());
  if (!by_name && ratio > 1.5 && longer) {
    warnings.push_back(
        {"swapped", fmt::format("the estimate {} is denser ({:.4g} Hz against {:.4g} Hz) and longer than "
                                "the reference {}, as ground truth usually is: are they swapped? The "
                                "reference comes first",
                                estimate_side.name, 1 / step_b, 1 / step_a, reference_side.name)});
  }
  if (ratio > 1.5 || ratio < 1 / 1.5) {
    warnings.push_back(
        {"rates",
         fmt::format("different rates: reference {:.4g} Hz, estimate {:.4g} Hz; poses are matched at "
                     "the lower one, and relative errors in frames span its steps",
                     1 / step_a, 1 / step_b)});
  }
  return warnings;
}

std::vector<TrajectoryWarning> warnings_of_matched(const PoseSeries& reference, const PoseSeries& estimate) {
  std::vector<TrajectoryWarning> warnings;
  if (!reference.has_rotations() || !estimate.has_rotations()) return warnings;
  const auto is_identity = [&](size_t i) {
    return reference.positions_m[i].isZero(0) && reference.rotations[i] == Eigen::Matrix3d::Identity();
  };
  const auto equal = [](const PoseSeries& s, size_t i, const PoseSeries& t, size_t j) {
    return s.positions_m[i] == t.positions_m[j] && s.rotations[i] == t.rotations[j];
  };
  size_t identities = 0, repeated = 0, first_repeated = 0, same = 0;
  // A recording may stand at its origin for a while, and the estimate with it.
  constexpr double stands_m = 0.5;
  bool left_origin = false;
  for (size_t i = 0; i < estimate.size(); ++i) {
    same += equal(reference, i, estimate, i);
    if (i == 0) continue;
    left_origin = left_origin || !is_identity(i) ||
                  (estimate.positions_m[i] - estimate.positions_m[0]).norm() > stands_m;
    identities += left_origin && is_identity(i);
    if (!equal(estimate, i, estimate, i - 1)) continue;
    constexpr double moves_m = 0.01, turns_rad = 0.001;
    const RelativePose step = relative_pose(reference, i - 1, i);
    if (step.translation_m.norm() < moves_m &&
        rotation_angle_rad(Eigen::Quaterniond(step.rotation)) < turns_rad)
      continue;
    if (repeated++ == 0) first_repeated = i;
  }
  if (repeated >= 5) {
    warnings.push_back(
        {"repeated_poses", fmt::format("the estimate repeats its last pose exactly {} times while the "
                                       "reference moves, first at matched pose {}: a lost tracker? Leave "
                                       "lost poses out, then they count against coverage",
                                       repeated, first_repeated)});
  }
  if (identities > 0) {
    warnings.push_back({"identity", fmt::format("{} reference poses are exactly the identity: missing truth "
                                                "that was logged as identity? These errors mean nothing",
                                                identities)});
  }
  if (same == estimate.size() && estimate.size() > 1)
    warnings.push_back({"identical", "all poses of estimate and reference are equal: the same file twice?"});
  return warnings;
}

}  // namespace sextant
