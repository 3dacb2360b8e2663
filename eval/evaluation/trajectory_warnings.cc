#include "sextant/eval/evaluation/trajectory_warnings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"
#include "sextant/eval/diagnosis/pose_readings.h"
#include "sextant/eval/evaluation/trajectory_agreement.h"
#include "sextant/eval/evaluation/trajectory_matching.h"
#include "sextant/eval/evaluation/trajectory_offset.h"
#include "sextant/eval/logs/number_file.h"

namespace sextant {

namespace {

bool has_any(const std::string& text, std::initializer_list<std::string_view> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return text.find(word) != std::string::npos; });
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
  const std::string name = lower_case(std::filesystem::path(side.name).filename().string());
  return has_any(name, {"groundtruth", "ground_truth", "ground-truth"}) || has_word(name, "gt") ||
         has_any(side.comments, {"ground truth", "groundtruth"});
}

bool claims_estimate(const TrajectorySide& side) {
  const std::string name = lower_case(std::filesystem::path(side.name).filename().string());
  return !claims_truth(side) &&
         (has_word(name, "est") || has_any(name, {"estimate", "slam", "odometry", "keyframetrajectory"}));
}

/// Warns of up to three steps of the estimate whose lengths differ from those of the reference ten times more
/// than in all other steps, and by a twentieth of the reference's extent. The scale of the estimate is the
/// median ratio of the lengths.
std::optional<DataWarning> warning_of_jumps(const TrajectoryPair& pair) {
  const PoseSeries &reference = pair.reference, &estimate = pair.estimate;
  constexpr size_t most_jumps = 3, fewest = 20;
  constexpr double least_times = 10, least_share = 0.05;
  if (estimate.size() < fewest) return std::nullopt;
  const auto length = [](const PoseSeries& s, size_t i) {
    return (s.positions_m[i] - s.positions_m[i - 1]).norm();
  };
  std::vector<double> ratios;
  Eigen::AlignedBox3d box;
  for (size_t i = 0; i < reference.size(); ++i) {
    box.extend(reference.positions_m[i]);
    if (i > 0 && length(reference, i) > 0) ratios.push_back(length(estimate, i) / length(reference, i));
  }
  if (ratios.empty()) return std::nullopt;
  const double scale = upper_median(ratios);
  if (!(scale > 0)) return std::nullopt;
  std::vector<std::pair<double, size_t>> steps;  // excess of the length, and the pose after the step
  for (size_t i = 1; i < estimate.size(); ++i)
    steps.emplace_back(length(estimate, i) - scale * length(reference, i), i);
  std::ranges::sort(steps, std::ranges::greater());
  size_t n_jumps = most_jumps;
  const double least = least_share * scale * box.diagonal().norm();
  while (n_jumps > 0 &&
         !(steps[n_jumps - 1].first > least && steps[n_jumps - 1].first > least_times * steps[n_jumps].first))
    --n_jumps;
  if (n_jumps == 0) return std::nullopt;
  std::vector<size_t> at;
  for (size_t i = 0; i < n_jumps; ++i) at.push_back(steps[i].second);
  std::ranges::sort(at);
  const std::string steps_are =
      n_jumps == 1 ? "1 step of the estimate is" : fmt::format("{} steps of the estimate are up to", n_jumps);
  return DataWarning{
      "jump",
      fmt::format(
          "{} {:.3g} m longer than in the reference, before matched pose {}; all other steps differ by less "
          "than a tenth of that. Did the tracker restart with another origin, or close a loop? After a "
          "restart one alignment cannot fit both parts: evaluate each part{}",
          steps_are, steps.front().first / scale, fmt::join(at, ", "),
          reference.stamps_s.empty() ? "" : " (--t-start, --t-end)")};
}

bool is_identity(const PoseSeries& poses, size_t i) {
  return poses.positions_m[i].isZero(0) &&
         (!poses.has_rotations() || poses.rotations[i] == Eigen::Matrix3d::Identity());
}

/// Rows of the poses after the first one that are exactly the identity after the side, or the other side, has
/// left its first pose. A recording may stand at its origin for a while, and the other side with it; written
/// with few digits, it may return to the identity there.
std::vector<size_t> lost_identities(const PoseSeries& side, const PoseSeries& other) {
  constexpr double stands_m = 0.5, share_of_extent = 0.01, turns_rad = 0.01;
  const auto moved_m = [](const PoseSeries& s, size_t i) {
    return (s.positions_m[i] - s.positions_m[0]).norm();
  };
  double extent_m = 0;
  for (size_t i = 0; i < side.size(); ++i) extent_m = std::max(extent_m, moved_m(side, i));
  std::vector<size_t> rows;
  bool left_origin = false;
  for (size_t i = 1; i < side.size(); ++i) {
    left_origin = left_origin || moved_m(side, i) > share_of_extent * extent_m ||
                  rotation_angle_rad(relative_pose(side, 0, i).rotation) > turns_rad ||
                  moved_m(other, i) > stands_m;
    if (left_origin && is_identity(side, i)) rows.push_back(i);
  }
  // The world of a path that is reversed in time is its last pose.
  if (rows.size() == 1 && rows.front() + 1 == side.size() && !is_identity(side, 0)) rows.clear();
  return rows;
}

bool equal(const PoseSeries& s, size_t i, const PoseSeries& t, size_t j) {
  return s.positions_m[i] == t.positions_m[j] && s.rotations[i] == t.rotations[j];
}

/// Number of poses that equal the pose before although the reference moves, and the row of the first one.
struct RepeatedPoses {
  size_t n = 0, first = 0;
};
RepeatedPoses repeated_poses(const TrajectoryPair& pair) {
  RepeatedPoses out;
  for (size_t i = 1; i < pair.size(); ++i) {
    if (!equal(pair.estimate, i, pair.estimate, i - 1)) continue;
    const RelativePose step = relative_pose(pair.reference, i - 1, i);
    if (!moves(SE3(Eigen::Quaterniond(step.rotation), step.translation_m))) continue;
    if (out.n++ == 0) out.first = i;
  }
  return out;
}

/// Largest angle between the first rotation and another one.
double turn_deg(const PoseSeries& poses) {
  double largest = 0;
  for (const Eigen::Matrix3d& R : poses.rotations)
    largest = std::max(largest, rotation_angle_rad(poses.rotations[0].transpose() * R));
  return degrees(largest);
}

/// Warns if all rotations of one side are equal while the other side turns.
std::optional<DataWarning> warning_of_equal_rotations(const TrajectoryPair& pair) {
  constexpr double least_deg = 5;
  const double of_reference = turn_deg(pair.reference), of_estimate = turn_deg(pair.estimate);
  if (std::min(of_reference, of_estimate) > 0 || std::max(of_reference, of_estimate) < least_deg)
    return std::nullopt;
  const auto [still, turning, flag] = of_estimate > 0 ? std::tuple("reference", "estimate", "--ref-format")
                                                      : std::tuple("estimate", "reference", "--est-format");
  return DataWarning{
      "no_rotations",
      fmt::format(
          "all rotations of the {} are equal, but the {} turns by up to {:.1f} deg: has the {} positions "
          "only? Then E_t, E_R and the other errors that need rotations mean nothing; write it as 't x y z' "
          "and give {} positions",
          still, turning, std::max(of_reference, of_estimate), still, flag)};
}

/// Returns the largest power of ten, 1e-4 m to 100 m, of which all coordinates of an axis are multiples; 0 if
/// there is none, or if the coordinate is constant.
double rounding_m(const PoseSeries& poses, int axis) {
  constexpr double relative = 1e-6, digits = 1e-15;
  for (const double step_m : {100.0, 10.0, 1.0, 0.1, 0.01, 0.001, 0.0001}) {
    bool varies = false;
    const bool all = std::ranges::all_of(poses.positions_m, [&](const Eigen::Vector3d& p) {
      varies = varies || p[axis] != poses.positions_m[0][axis];
      const double steps = p[axis] / step_m;
      return std::abs(steps - std::round(steps)) <= relative + digits * std::abs(steps);
    });
    if (all) return varies ? step_m : 0;
  }
  return 0;
}

/// Warns if the coordinates of one side were rounded so that this explains more than half of the squared
/// errors of the translations from pose to pose. The difference of two numbers that are rounded to multiples
/// of q has the variance q^2 / 6, over two poses as well as over one; errors of steps accumulate.
std::optional<DataWarning> warning_of_rounding(const TrajectoryPair& pair) {
  constexpr size_t fewest = 20;
  // Errors smaller than those that rounding causes show that the coordinates are exact and were not rounded.
  constexpr double explained = 0.5, contradicted = 2, least_share_of_step = 0.01, most_growth = 1.5;
  if (pair.size() < fewest) return std::nullopt;
  std::vector<double> lengths;
  for_each_step(pair, 1, 1, [&](const RelativePose& r, const RelativePose&) {
    lengths.push_back(r.translation_m.norm());
  });
  const auto mean_squares = [&](size_t k) {
    double sum = 0;
    for_each_step(pair, k, 1, [&](const RelativePose& r, const RelativePose& e) {
      sum += (e.translation_m - r.translation_m).squaredNorm();
    });
    return sum / static_cast<double>(pair.size() - k);
  };
  const double squares = mean_squares(1);
  if (!(squares > 0) || mean_squares(2) > most_growth * squares) return std::nullopt;
  const double step_m = upper_median(lengths);
  for (const auto& [side, name] :
       {std::pair(&pair.estimate, "estimate"), std::pair(&pair.reference, "reference")}) {
    double variance = 0, largest_m = 0;
    for (const int axis : {0, 1, 2}) {
      const double q = rounding_m(*side, axis);
      variance += q * q / 6;
      largest_m = std::max(largest_m, q);
    }
    if (variance < explained * squares || variance > contradicted * squares) continue;
    if (largest_m < least_share_of_step * step_m) continue;
    return DataWarning{
        "rounded",
        fmt::format(
            "the positions of the {} are multiples of {:g} m, which explains {:.0f} % of the squared "
            "errors of relative translations: were they written with too few digits? Write them with all "
            "digits, as \"%.9f\" does",
            name, largest_m, 100 * std::min(1.0, variance / squares))};
  }
  return std::nullopt;
}

/// Counts the poses that find a partner; several poses with the same partner count once.
size_t count_partners(const std::vector<double>& reference, std::vector<double> estimate, double factor,
                      double offset_s, double max_difference_s) {
  for (double& t : estimate) t = t * factor + offset_s;
  const Association found = associate_by_time(reference, estimate, {.max_difference_s = max_difference_s});
  const std::set<int> rows(found.reference.begin(), found.reference.end());
  const std::set<int> own(found.estimate.begin(), found.estimate.end());
  return std::min(rows.size(), own.size());
}

struct Unit {
  double factor;  ///< factor from the stated to this unit, on the estimate's stamps
  const char* side;
  const char* unit;
};
constexpr std::array<Unit, 6> units = {{{1e-3, "estimate", "ms"},
                                        {1e-6, "estimate", "us"},
                                        {1e-9, "estimate", "ns"},
                                        {1e3, "reference", "ms"},
                                        {1e6, "reference", "us"},
                                        {1e9, "reference", "ns"}}};

std::string remedy_of(const Unit& unit) {
  const std::string header =
      fmt::format("write '# t [{}] tx ty tz qx qy qz qw' above its first line", unit.unit);
  if (std::string_view(unit.unit) != "ns") return header;
  return fmt::format("give --{}-format tum_ns, or {}",
                     std::string_view(unit.side) == "estimate" ? "est" : "ref", header);
}

}  // namespace

std::vector<DataWarning> warnings_of_pair(const PoseSeries& reference, const TrajectorySide& reference_side,
                                          const PoseSeries& estimate, const TrajectorySide& estimate_side,
                                          bool interpolates) {
  std::vector<DataWarning> warnings;
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
    constexpr double shortest_s = 1e-5, longest_s = 10;
    if (step >= shortest_s && step <= longest_s) continue;
    warnings.push_back({"clock", fmt::format("the time steps of {} are {:.3g} s: are its stamps seconds?",
                                             side->name, step)});
  }
  const double ratio = step_a / step_b;
  // A sparse reference, as of GNSS, begins and ends up to a step within the time that it covers.
  const bool longer = b.back() - b.front() > 1.02 * (a.back() - a.front()) + 2 * step_a;
  if (!by_name && ratio > 1.5 && longer && reference.has_rotations()) {
    warnings.push_back(
        {"swapped", fmt::format("the estimate {} is denser ({:.4g} Hz against {:.4g} Hz) and longer than "
                                "the reference {}, as ground truth usually is: are they swapped? The "
                                "reference comes first",
                                estimate_side.name, 1 / step_b, 1 / step_a, reference_side.name)});
  }
  if (ratio > 1.5 || ratio < 1 / 1.5) {
    warnings.push_back(
        {"rates",
         fmt::format("different rates: reference {:.4g} Hz, estimate {:.4g} Hz; {}", 1 / step_a, 1 / step_b,
                     interpolates ? "the reference is interpolated at the estimate's time stamps, "
                                    "and relative errors in frames span the estimate's steps"
                                  : "poses are matched at the lower one, and relative errors in "
                                    "frames span its steps")});
  }
  return warnings;
}

std::vector<DataWarning> warnings_of_matched(const TrajectoryPair& pair) {
  const PoseSeries &reference = pair.reference, &estimate = pair.estimate;
  std::vector<DataWarning> warnings;
  const bool rotations = pair.has_rotations();
  const std::vector<size_t> lost = rotations ? lost_identities(estimate, reference) : std::vector<size_t>();
  const RepeatedPoses repeated = rotations ? repeated_poses(pair) : RepeatedPoses();
  // A pose that is held, from the origin on as well, is no lost frame.
  if (!lost.empty() && repeated.n <= 10 * lost.size()) {
    warnings.push_back(
        {"lost_poses",
         fmt::format("{} pose{} of the estimate {} exactly the identity, first at matched pose "
                     "{}, although the trajectory has left its origin: lost frames that were "
                     "written as identity? Leave them out, then they count against coverage",
                     lost.size(), lost.size() > 1 ? "s" : "", lost.size() > 1 ? "are" : "is", lost.front())});
  } else if (auto jumps = warning_of_jumps(pair)) {
    warnings.push_back(std::move(*jumps));
  }
  if (!rotations) return warnings;
  if (auto found = warning_of_equal_rotations(pair)) warnings.push_back(std::move(*found));
  if (auto found = warning_of_rounding(pair)) warnings.push_back(std::move(*found));
  if (repeated.n >= 5) {
    warnings.push_back(
        {"repeated_poses", fmt::format("the estimate repeats its last pose exactly {} times while the "
                                       "reference moves, first at matched pose {}: a lost tracker? Leave "
                                       "lost poses out, then they count against coverage",
                                       repeated.n, repeated.first)});
  }
  if (const std::vector<size_t> missing = lost_identities(reference, estimate); !missing.empty()) {
    warnings.push_back({"identity", fmt::format("{} reference poses are exactly the identity: missing truth "
                                                "that was logged as identity? These errors mean nothing",
                                                missing.size())});
  }
  bool same = estimate.size() > 1;
  for (size_t i = 0; same && i < estimate.size(); ++i) same = equal(reference, i, estimate, i);
  if (same)
    warnings.push_back({"identical", "all poses of estimate and reference are equal: the same file twice?"});
  return warnings;
}

std::optional<PoseSeries> without_identities(const PoseSeries& poses) {
  size_t first = 0;
  while (first < poses.size() && is_identity(poses, first)) ++first;
  std::vector<int> kept;
  for (size_t i = 0; i < poses.size(); ++i) {
    if (i < first || !is_identity(poses, i)) kept.push_back(static_cast<int>(i));
  }
  if (kept.size() == poses.size()) return std::nullopt;
  PoseSeries out = poses;
  if (out.stamps_s.empty() && out.frames.empty()) out.frames = frames_of(out);  // rows are frame numbers
  out.keep(kept);
  return out;
}

void check_physical(const PoseSeries& poses, const std::string& name, double max_speed_m_s) {
  constexpr double shortest_m = 0.3, longest_m = 50;
  const bool stamped = !poses.stamps_s.empty();
  for (size_t i = 1; i < poses.size(); ++i) {
    const double step_m = (poses.positions_m[i] - poses.positions_m[i - 1]).norm();
    const int frames = poses.frames.empty() ? 1 : poses.frames[i] - poses.frames[i - 1];
    const double duration_s = stamped ? poses.stamps_s[i] - poses.stamps_s[i - 1] : 0;
    const bool absurd = stamped ? step_m > max_speed_m_s * duration_s : step_m > longest_m * frames;
    if (step_m <= shortest_m || !absurd) continue;
    std::string place = poses.lines.empty() ? "" : fmt::format(":{}", poses.lines[i]);
    if (place.empty())
      place =
          poses.frames.empty() ? fmt::format(": pose {}", i + 1) : fmt::format(": frame {}", poses.frames[i]);
    const bool is_lost = is_identity(poses, i);
    if (is_lost || (i > 1 && is_identity(poses, i - 1))) {
      fail(
          "{}{}: the true pose {} exactly the identity, {:.4g} m from the next: missing truth that was "
          "logged as identity? Leave such poses out",
          name, place, is_lost ? "is" : "before is", step_m);
    }
    const std::string what = stamped ? fmt::format("{:.4g} m in {:.4g} s, {:.4g} m/s, is above {:.4g} m/s",
                                                   step_m, duration_s, step_m / duration_s, max_speed_m_s)
                                     : fmt::format("{:.4g} m in {} frame{} is above {:.4g} m a frame", step_m,
                                                   frames, frames == 1 ? "" : "s", longest_m);
    fail(
        "{}{}: the true step is implausible: {}; expected metres and {}: is a pose an outlier, or the unit "
        "wrong? --max-speed sets the limit",
        name, place, what, stamped ? "seconds" : "one pose a frame");
  }
}

size_t fewest_matched(size_t n_shorter) {
  constexpr size_t fewest = 3, tenth = 10;
  return std::max(fewest, (n_shorter + tenth - 1) / tenth);
}

std::string explain_unmatched(const PoseSeries& reference, const PoseSeries& estimate,
                              const AssociationOptions& options) {
  const std::vector<double>&a = reference.stamps_s, &b = estimate.stamps_s;
  const size_t shorter = std::min(a.size(), b.size());
  const size_t enough = std::max<size_t>(2, shorter / 2);
  std::string text =
      fmt::format("the reference's time stamps are {:.10g} .. {:.10g} s, the estimate's {:.10g} .. {:.10g} s",
                  a.front(), a.back(), b.front(), b.back());
  const auto tolerance = [&](double factor) {
    const double step = a.size() > 1 && b.size() > 1 ? std::min(median_step(a), factor * median_step(b)) : 0;
    return std::max(options.max_difference_s, 0.25 * step);
  };
  for (const bool with_offset : {false, true}) {
    const Unit* best = nullptr;
    size_t most = 0;
    for (const Unit& unit : units) {
      const double offset_s = with_offset ? a.front() - unit.factor * b.front() : options.offset_s;
      const size_t n = count_partners(a, b, unit.factor, offset_s, tolerance(unit.factor));
      if (n > most) {
        most = n;
        best = &unit;
      }
    }
    const double offset_s = a.front() - b.front();
    const size_t by_offset = with_offset ? count_partners(a, b, 1, offset_s, tolerance(1)) : 0;
    if (by_offset >= enough && by_offset >= most) {
      return text + fmt::format(
                        "; with an offset of {:.6f} s {} poses match: give --offset {:.6f}, which "
                        "--estimate-offset refines",
                        offset_s, by_offset, offset_s);
    }
    if (!best || most < enough) continue;
    text += fmt::format("; read as {} {} of the {}'s time stamps match: {}", best->unit, most, best->side,
                        remedy_of(*best));
    if (with_offset) {
      const double seconds = std::string_view(best->side) == "estimate" ? 1 : 1 / best->factor;
      text += fmt::format(", and --offset {:.6f}", (a.front() - best->factor * b.front()) * seconds);
    }
    return text;
  }
  const double nearest = [&] {
    std::vector<double> distances;
    for (const double t : b) {
      const auto at = std::ranges::lower_bound(a, t + options.offset_s);
      double d = at == a.end() ? std::abs(t + options.offset_s - a.back()) : *at - t - options.offset_s;
      if (at != a.begin() && at != a.end()) d = std::min(d, t + options.offset_s - at[-1]);
      distances.push_back(d);
    }
    std::ranges::sort(distances);
    return distances[distances.size() / 2];
  }();
  if (nearest <= 1 && a.size() > 1 && nearest <= 2 * median_step(a)) {
    return text +
           fmt::format("; the nearest stamps are {:.3g} s apart in the median: give --max-difference, or {}",
                       nearest, interpolate_flag(a));
  }
  return text +
         ": check the clocks, the unit of time (a header 't [ms]' names it), --offset and --max-difference";
}

}  // namespace sextant
