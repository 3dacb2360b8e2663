#include "sextant/eval/evaluation/ego_evaluation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"
#include "sextant/eval/evaluation/time_shift_warnings.h"
#include "sextant/eval/evaluation/trajectory_agreement.h"
#include "sextant/eval/evaluation/trajectory_explanation.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {
namespace {

/// Computes PerFrameErrors::ER_float_acos_deg.
std::vector<double> float_acos_errors_deg(const EgoResult& r, const std::vector<PosePair>& pairs) {
  std::vector<double> errors;
  for (const auto& [i, j] : pairs) {
    const auto step = [i = static_cast<size_t>(i), j = static_cast<size_t>(j)](const PoseSeries& series) {
      return Eigen::Matrix3f(series.rotations[i].cast<float>().transpose() *
                             series.rotations[j].cast<float>());
    };
    const float cosine = ((step(r.reference).transpose() * step(r.estimate)).trace() - 1) / 2;
    const float angle_rad = std::acos(cosine);
    if (angle_rad > 0) errors.push_back(angle_rad * 180 / std::numbers::pi);
  }
  return errors;
}

/// Computes the errors of consecutive matched poses that are one frame apart.
PerFrameErrors per_frame_errors(const EgoResult& r) {
  PerFrameErrors out;
  if (!r.has_rotations()) return out;
  std::vector<PosePair> pairs;
  const std::vector<int> frames = r.reference.frames.empty() ? r.reference_rows : r.reference.frames;
  const bool by_time = !r.reference.stamps_s.empty() && !r.estimate.stamps_s.empty();
  const std::vector<double> times = r.times_of_matches();
  const double frame_s = median_step(times);
  const auto is_one_frame = [&](size_t i) {
    if (!by_time) return frames[i] == frames[i - 1] + 1;
    return std::abs(times[i] - times[i - 1] - frame_s) <= 0.5 * frame_s;
  };
  for (size_t i = 1; i < r.estimate.size(); ++i) {
    if (!is_one_frame(i)) {
      ++out.n_left_out;
      continue;
    }
    pairs.emplace_back(static_cast<int>(i) - 1, static_cast<int>(i));
    out.row.push_back(r.reference_rows[i]);
    out.step_error_m.push_back(relative_pose(r.estimate, i - 1, i).translation_m -
                               relative_pose(r.reference, i - 1, i).translation_m);
  }
  out.Et_m = relative_errors(r.estimate, r.reference, pairs, PoseRelation::trans_part);
  out.ER_deg = relative_errors(r.estimate, r.reference, pairs, PoseRelation::angle_deg);
  out.ER_float_acos_deg = float_acos_errors_deg(r, pairs);
  return out;
}

void warn_of_share(const EgoResult& r, const EvaluatedRange& range, std::vector<DataWarning>& warnings) {
  constexpr double least_share = 0.8;
  const size_t shorter = range.shorter();
  const double share = static_cast<double>(r.estimate.size()) / static_cast<double>(shorter);
  if (share < least_share) {
    warnings.push_back(
        {"unmatched", fmt::format("only {} of {} poses ({:.0f} %) have a partner: check the clocks, "
                                  "--offset and --max-difference",
                                  r.estimate.size(), shorter, 100 * share)});
  }
  const std::vector<double> matched = times_of(r.reference);
  const double covered = (matched.back() - matched.front()) / range.duration;
  const bool by_row = r.reference.stamps_s.empty() && r.reference.frames.empty();
  if (!by_row && covered < least_share) {
    warnings.push_back(
        {"coverage",
         fmt::format("the estimate covers {:.0f} % of the reference's duration: the rest does not count in "
                     "these errors",
                     100 * covered)});
  }
}

/// If only one side has frame numbers, the rows of the other side are taken as frame numbers, which is wrong
/// if its recording began later.
void warn_of_rows(const PoseSeries& reference, const PoseSeries& estimate,
                  std::vector<DataWarning>& warnings) {
  const bool by_time = !reference.stamps_s.empty() && !estimate.stamps_s.empty();
  if (by_time || reference.frames.empty() == estimate.frames.empty()) return;
  const std::vector<int>& frames = reference.frames.empty() ? estimate.frames : reference.frames;
  if (frames.front() == 0) return;
  const char* without = reference.frames.empty() ? "reference" : "estimate";
  warnings.push_back(
      {"rows",
       fmt::format("the {} has no frame numbers, so its first pose is taken as frame 0, but the other side "
                   "begins at frame {}: put the frame number before the 12 values of each line",
                   without, frames.front())});
}

bool has_any(const std::vector<DataWarning>& warnings, std::initializer_list<std::string_view> codes) {
  return std::ranges::any_of(
      warnings, [&](const DataWarning& w) { return std::ranges::find(codes, w.code) != codes.end(); });
}

/// Throws Error if too few poses match for a meaningful result.
void check_matched(const EgoResult& r, const EgoReference& reference, const PoseSeries& estimate,
                   const EgoOptions& options, const AssociationOptions& association,
                   const EvaluatedRange& range) {
  const size_t shorter = range.shorter();
  if (r.estimate.size() >= fewest_matched(shorter)) return;
  if (shorter > 0 && shorter < fewest_matched(shorter)) {
    const std::string of_reference =
        range.n_reference < range.n_estimate ? fmt::format("the reference {} ", reference.side.name) : "";
    fail("{}: {}has only {} pose{} to evaluate, at least {} are needed", r.name, of_reference, shorter,
         shorter == 1 ? "" : "s", fewest_matched(shorter));
  }
  const std::string what =
      r.estimate.empty()
          ? fmt::format("no pose matches the reference {}", reference.side.name)
          : fmt::format("only {} of {} poses match the reference {}, at least {} are needed",
                        r.estimate.size(), shorter, reference.side.name, fewest_matched(shorter));
  const bool stamped = !reference.poses.stamps_s.empty() && !estimate.stamps_s.empty();
  if (!stamped) fail("{}: {}: check the frame numbers", r.name, what);
  if (r.offset && !options.interpolate_max_gap_s) {
    fail(
        "{}: {} within --max-difference {} s after --estimate-offset has added {:.6f} s to the estimate's "
        "time stamps: give {} too, which needs no common time stamps",
        r.name, what, association.max_difference_s, r.offset_s, interpolate_flag(reference.poses.stamps_s));
  }
  fail("{}: {} within --{} s: {}", r.name, what,
       options.interpolate_max_gap_s ? fmt::format("interpolate {}", *options.interpolate_max_gap_s)
                                     : fmt::format("max-difference {}", association.max_difference_s),
       explain_unmatched(reference.poses, estimate, association));
}

void put_errors(EgoResult& r, const EgoOptions& options) {
  const PoseSeries& paired = options.pairs_from_reference ? r.reference : r.estimate;
  if (options.rpe_lengths.size() < 2) return;
  for (const PairSelection& length : options.rpe_lengths) {
    ErrorsOverLength over{length, {}, {}};
    try {
      std::vector<PosePair> pairs = select_pairs(paired, length);
      if (options.relation == PoseRelation::point_distance_error_ratio)
        std::erase_if(pairs, [&](const PosePair& pair) { return pair_distance_m(r.reference, pair) == 0; });
      over.errors = relative_errors(r.estimate, r.reference, pairs, options.relation);
    } catch (const Error&) {
      if (needs_rotations(options.relation, true) && !r.has_rotations()) throw;
    }
    if (!over.errors.empty()) over.statistics = error_statistics(over.errors);
    r.by_length.push_back(std::move(over));
  }
}

/// Returns the RMS distance of the points from the line through their mean along the unit vector `axis`.
double rms_across(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& axis) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  double sum = 0;
  for (const Eigen::Vector3d& p : points) sum += axis.cross(p - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// Returns the standard error of the rotation about the principal axis of the path after an alignment of
/// positions: RMS residual across this axis / (sqrt(n) RMS extent across it), for independent errors. The
/// extent is that of the straighter side, because errors widen the other one.
double roll_standard_error_deg(const EgoResult& r, int n_to_align) {
  const size_t n =
      n_to_align > 0 ? std::min(static_cast<size_t>(n_to_align), r.estimate.size()) : r.estimate.size();
  const auto reference = std::span(r.reference.positions_m).first(n);
  const auto estimate = std::span(r.estimate.positions_m).first(n);
  std::vector<Eigen::Vector3d> residuals;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d d = reference[i] - reference[0];
    scatter += d * d.transpose();
    residuals.push_back(estimate[i] - reference[i]);
  }
  const Eigen::Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
  const double residual_m = rms_across(residuals, axis);
  const double extent_m = std::min(rms_across(reference, axis), rms_across(estimate, axis));
  if (residual_m == 0) return 0;
  return residual_m / (std::sqrt(static_cast<double>(n)) * extent_m) * 180 / std::numbers::pi;
}

void warn_of_alignment(const EgoResult& r, const EgoOptions& options, const AlignmentChoice& choice,
                       std::vector<DataWarning>& warnings) {
  const bool is_explained = has_any(warnings, {"lag", "unit", "degrees", "steps", "inverse", "lost_poses",
                                               "no_offset", "clock_rate", "reversed"});
  // The scale of a standstill is that of the noise.
  constexpr double least_extent_m = 0.1;
  const bool moves = rms_extent_m(r.reference) >= least_extent_m;
  if (!choice.scales() && !is_explained && moves && r.umeyama_scale &&
      std::abs(std::log(*r.umeyama_scale)) > std::log(1.1)) {
    const bool is_line = !umeyama(r.estimate.positions_m, r.reference.positions_m, true);
    warnings.push_back(
        {"scale", fmt::format("the estimate fits best when scaled by {:.4g}, but --align {} does not correct "
                              "scale; a system without metric scale needs --align {}",
                              *r.umeyama_scale, to_string(options.alignment), is_line ? "scale" : "sim3")});
  }
  constexpr double flat = 1e-12;
  if (r.alignment.flatness < flat) {
    warnings.push_back({"line",
                        "the positions lie on a straight line: the rotation about it is arbitrary after this "
                        "alignment, and errors of rotation mean nothing"});
    return;
  }
  const bool enters_errors = !options.rpe() && needs_rotations(options.relation, false);
  if (!choice.turns_world() || !enters_errors) return;
  constexpr double largest_deg = 0.5;
  const double error_deg = roll_standard_error_deg(r, options.n_to_align);
  if (error_deg <= largest_deg) return;
  warnings.push_back(
      {"line",
       fmt::format("the positions lie nearly on a straight line: their alignment determines the "
                   "rotation about it only with a standard error of {}, which enters the errors of "
                   "rotation; use --align origin or yaw, or a relation of positions such as trans_part",
                   error_deg < 90 ? fmt::format("{:.2g} deg", error_deg) : "more than 90 deg")});
}

/// Drops pairs between which the reference stands still: their error has no ratio to the distance.
void drop_still_pairs(EgoResult& r) {
  const size_t n = r.pairs.size();
  std::erase_if(r.pairs, [&](const PosePair& pair) { return pair_distance_m(r.reference, pair) == 0; });
  const size_t dropped = n - r.pairs.size();
  if (r.pairs.empty())
    fail("{}: the reference does not move between any pair of poses: use --relation point_distance", r.name);
  if (dropped > 0) {
    r.warnings.push_back(
        {"still_pairs", fmt::format("{} of {} pairs are left out: the reference does not move between them, "
                                    "which leaves no distance to relate errors to",
                                    dropped, n)});
  }
}

/// Warns of pairs that are chosen by number of frames, but between which poses are missing.
void warn_of_longer_pairs(EgoResult& r, const PairSelection& selection) {
  if (selection.unit != DeltaUnit::frames) return;
  const std::vector<double> times = r.times_of_matches();
  std::vector<double> durations;
  for (const auto& [first, second] : r.pairs)
    durations.push_back(times[static_cast<size_t>(second)] - times[static_cast<size_t>(first)]);
  const double usual = upper_median(durations);
  const auto n = std::ranges::count_if(durations, [&](double duration) { return duration > 1.5 * usual; });
  constexpr double least_share = 0.01;
  if (static_cast<double>(n) <= least_share * static_cast<double>(durations.size())) return;
  r.warnings.push_back(
      {"longer_pairs",
       fmt::format(
           "{} of {} pairs of --rpe {} span more than 1.5 times the usual time, because poses between "
           "them are missing: their errors belong to longer motions; comparisons of systems use "
           "the pairs that both have",
           n, durations.size(), selection.text())});
}

}  // namespace

int EgoResult::first_row_of(size_t i) const {
  return pairs.empty() ? 0 : reference_rows[static_cast<size_t>(pairs[i].first)];
}

int EgoResult::row_of(size_t i) const {
  return reference_rows[pairs.empty() ? i : static_cast<size_t>(pairs[i].second)];
}

std::vector<double> EgoResult::times_of_matches() const {
  std::vector<double> times = reference.stamps_s;
  if (times.empty() && !reference.frames.empty())
    times.assign(reference.frames.begin(), reference.frames.end());
  if (times.empty()) times.assign(reference_rows.begin(), reference_rows.end());
  const bool repeats = std::ranges::adjacent_find(times, std::greater_equal()) != times.end();
  if (!repeats || estimate.stamps_s.empty()) return times;
  times = estimate.stamps_s;
  for (double& t : times) t += offset_s;
  return times;
}

std::string EgoResult::text_of(const DataWarning& warning) const {
  const bool names_file = warning.text.starts_with(file + ":") || warning.text.starts_with(name + ":");
  return names_file ? warning.text : fmt::format("{}: {}", name, warning.text);
}

void mark_same_runs(std::vector<EgoResult>& runs) {
  for (size_t i = 1; i < runs.size(); ++i) {
    EgoResult& run = runs[i];
    const auto end = runs.begin() + static_cast<std::ptrdiff_t>(i);
    const auto same = std::find_if(runs.begin(), end, [&](const EgoResult& other) {
      return other.system == run.system && other.reference_rows == run.reference_rows &&
             other.estimate.positions_m == run.estimate.positions_m &&
             other.estimate.rotations == run.estimate.rotations;
    });
    if (same == end) continue;
    run.warnings.push_back(
        {"same_run", fmt::format("has the same poses as {}: a file given twice, or a system without any "
                                 "randomness? Both count as one run in pooled errors, intervals and p",
                                 same->name)});
  }
}

namespace {

/// Returns the median number of later pairs that begin before a pair ends; pairs ascend by their first pose.
size_t n_overlapping(const std::vector<PosePair>& pairs) {
  std::vector<double> counts;
  for (size_t i = 0; i < pairs.size(); ++i) {
    size_t end = i + 1;
    while (end < pairs.size() && pairs[end].first < pairs[i].second) ++end;
    counts.push_back(static_cast<double>(end - i - 1));
  }
  return counts.empty() ? 0 : static_cast<size_t>(upper_median(counts));
}

}  // namespace

std::vector<RunErrors> run_errors(const std::vector<EgoResult>& runs) {
  std::vector<RunErrors> out;
  for (const EgoResult& r : runs) {
    RunErrors run{r.system, r.name, {}, {}, n_overlapping(r.pairs)};
    if (!has_any(r.warnings, {"same_run"})) run.errors = r.errors;
    for (size_t i = 0; i < run.errors.size(); ++i) run.steps.emplace_back(r.first_row_of(i), r.row_of(i));
    out.push_back(std::move(run));
  }
  return out;
}

EgoResult evaluate_ego(const EgoReference& reference, TrajectoryFile estimate, const std::string& name,
                       const EgoOptions& options) {
  EgoResult r{.name = name,
              .file = name,
              .system = name,
              .n_reference = reference.poses.size(),
              .n_estimate = estimate.poses.size()};
  for (const std::string& text : estimate.warnings) r.warnings.push_back({"repaired", text});
  const auto add = [&](std::vector<DataWarning> more) { append(r.warnings, std::move(more)); };
  to_camera(estimate.poses, options.estimate_frame);
  add(warnings_of_pair(reference.poses, reference.side, estimate.poses,
                       {name, estimate.comments, estimate.format},
                       options.interpolate_max_gap_s.has_value()));
  AssociationOptions association = options.association;
  if (options.estimate_offset) {
    if (reference.poses.stamps_s.empty() || estimate.poses.stamps_s.empty())
      fail("{}: --estimate-offset needs time stamps in both reference and estimate", name);
    r.offset = estimate_offset(reference.poses, estimate.poses, association.offset_s, name);
    association.offset_s = r.offset->offset_s;
  }
  r.offset_s = association.offset_s;
  // An estimated offset need not be a multiple of the time steps, so that few stamps may match without
  // interpolation.
  const std::vector<double>& stamps_s = reference.poses.stamps_s;
  const bool advises_interpolation = !options.interpolate_max_gap_s && stamps_s.size() >= 2;
  const std::string interpolate = advises_interpolation ? " " + interpolate_flag(stamps_s) : "";
  const auto remedy = [&](double offset_s) {
    return fmt::format("--offset {:.4f}, or --estimate-offset{}", offset_s, interpolate);
  };
  warn_of_rows(reference.poses, estimate.poses, r.warnings);
  const AlignmentChoice choice = {options.alignment, options.n_to_align,
                                  options.up.value_or(Eigen::Vector3d::Zero())};
  const std::optional<PoseSeries> tracked = without_identities(estimate.poses);
  const PoseSeries& moving = tracked ? *tracked : estimate.poses;
  auto lag = warning_of_clock_rate(reference.poses, moving, association.offset_s, choice);
  if (!lag) lag = warning_of_lag(reference.poses, moving, association.offset_s, choice, remedy);
  if (lag) add({*lag});
  const bool clock_is_reported = lag || options.estimate_offset;
  MatchedPoses matched =
      match_poses(reference.poses, estimate.poses, association, options.interpolate_max_gap_s, name);
  r.reference = std::move(matched.reference);
  r.estimate = std::move(matched.estimate);
  r.reference_rows = std::move(matched.reference_rows);
  r.interpolation = matched.interpolation;
  const EvaluatedRange range = evaluated_range(reference.poses, estimate.poses, association);
  check_matched(r, reference, estimate.poses, options, association, range);
  estimate.poses = {};  // `r` holds the matched poses
  warn_of_share(r, range, r.warnings);
  add(warnings_of_matched(r));

  r.umeyama_scale = umeyama_scale(r.estimate.positions_m, r.reference.positions_m);
  const auto clock =
      clock_is_reported ? std::nullopt
                        : warning_of_clock(reference.poses, r.estimate, association.offset_s, choice, remedy);
  if (clock) add({*clock});  // a shifted clock would cause the other findings
  if (!clock) {
    const size_t n = r.warnings.size();
    add(warnings_of_explanations(r, choice, options.estimate_frame, options.reference_frame));
    const bool explained = r.warnings.size() > n;
    const auto shift = clock_is_reported || explained
                           ? std::nullopt
                           : warning_of_rows(r, association.offset_s, choice, remedy);
    if (shift) add({*shift});
    const bool by_convention = explained && !has_any(r.warnings, {"lever_arm", "yaw", "world"});
    const auto kind = by_convention ? std::nullopt : warning_of_alignment_kind(r, choice);
    if (kind) add({*kind});
    const bool is_explained =
        lag || explained || shift ||
        has_any(r.warnings, {"lost_poses", "jump", "repeated_poses", "identity", "no_rotations"});
    if (!is_explained) add(warnings_of_disagreement(r, choice));
  }
  try {
    r.alignment = align(r.estimate, r.reference, choice.alignment, choice.n_to_align, choice.up);
  } catch (const Error& error) {
    fail("{}: {}", name, error.what());
  }
  warn_of_alignment(r, options, choice, r.warnings);
  if (options.rpe()) {
    r.pairs = select_pairs(options.pairs_from_reference ? r.reference : r.estimate, *options.rpe());
    warn_of_longer_pairs(r, *options.rpe());
    if (options.relation == PoseRelation::point_distance_error_ratio) drop_still_pairs(r);
    r.errors = relative_errors(r.estimate, r.reference, r.pairs, options.relation);
  } else {
    r.errors = absolute_errors(r.estimate, r.reference, options.relation);
  }
  put_errors(r, options);
  for (size_t i = 0; i < r.errors.size(); ++i) {
    constexpr double largest = 1e100;  // squares of smaller errors can be summed without overflow
    if (!(r.errors[i] <= largest)) {
      fail("{}: the error at pose {} of the reference {} is {}: expected a number of at most {}", name,
           r.row_of(i) + 1, reference.side.name, r.errors[i], largest);
    }
  }
  r.statistics = error_statistics(r.errors);
  r.per_frame = per_frame_errors(r);
  r.consistency = trajectory_consistency(r.estimate, r.reference, name);
  if (r.has_rotations()) r.kitti = kitti_odometry_errors(r.estimate, r.reference);
  return r;
}

}  // namespace sextant
