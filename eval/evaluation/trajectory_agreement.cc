#include "sextant/eval/evaluation/trajectory_agreement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sextant/base/error.h"
#include "sextant/base/quantile.h"
#include "sextant/eval/diagnosis/motion_disagreement.h"
#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/eval/evaluation/trajectory_explanation.h"

namespace sextant {

PoseSeries thinned(const PoseSeries& series, size_t first, size_t n) {
  constexpr size_t enough = 1000;
  const size_t every = (n + enough - 1) / enough;
  PoseSeries out;
  const auto keep_in = [&](auto& kept, const auto& values) {
    for (size_t i = 0; i < n && !values.empty(); i += every) kept.push_back(values[first + i]);
  };
  keep_in(out.rotations, series.rotations);
  keep_in(out.positions_m, series.positions_m);
  keep_in(out.stamps_s, series.stamps_s);
  keep_in(out.frames, series.frames);
  keep_in(out.covariances, series.covariances);
  keep_in(out.lines, series.lines);
  return out;
}

PoseSeries thinned(const PoseSeries& series) { return thinned(series, 0, series.size()); }

TrajectoryPair thinned(const TrajectoryPair& pair) {
  return {thinned(pair.reference), thinned(pair.estimate)};
}

Agreement agreement(const TrajectoryPair& pair) {
  const auto& [reference, estimate] = pair;
  Agreement out{.n = reference.size()};
  for (size_t i = 0; i < reference.size(); ++i) {
    out.squares += (reference.positions_m[i] - estimate.positions_m[i]).squaredNorm();
    if (pair.has_rotations())
      out.angle_deg +=
          degrees(rotation_angle_rad(reference.rotations[i].transpose() * estimate.rotations[i])) /
          static_cast<double>(reference.size());
  }
  return out;
}

void turn_about_path(TrajectoryPair& pair) {
  auto& [reference, estimate] = pair;
  const Eigen::Vector3d mean = mean_position(reference);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero(), M = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < reference.size(); ++i) {
    const Eigen::Vector3d d = reference.positions_m[i] - mean;
    spread += d * d.transpose();
    M += reference.rotations[i] * estimate.rotations[i].transpose();
  }
  const Eigen::Vector3d line = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
  const Eigen::Vector3d w(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
  const double along = line.dot(M * line);
  const Eigen::AngleAxisd roll(std::atan2(line.dot(w), M.trace() - along), line);
  for (size_t i = 0; i < estimate.size(); ++i) {
    estimate.rotations[i] = roll * estimate.rotations[i];
    estimate.positions_m[i] = mean + roll * (estimate.positions_m[i] - mean);
  }
}

std::optional<TrajectoryPair> aligned(TrajectoryPair pair, const AlignmentChoice& choice) {
  constexpr double flat = 1e-3;
  try {
    align(pair.estimate, pair.reference, choice.alignment, choice.n_to_align, choice.up);
  } catch (const Error&) {
    return std::nullopt;
  }
  if (choice.turns_world() && pair.has_rotations()) {
    // An alignment to positions on a line does not determine the rotation about it: the rotations of the
    // poses do.
    const auto u = umeyama(pair.reference.positions_m, pair.reference.positions_m, false);
    if (!u || u->flatness < flat) turn_about_path(pair);
  }
  return pair;
}

std::optional<Agreement> aligned_agreement(const TrajectoryPair& pair, const AlignmentChoice& choice) {
  const auto found = aligned(thinned(pair), choice);
  return found ? std::optional(agreement(*found)) : std::nullopt;
}

// ---- Warnings

namespace {

/// Smallest RMSE of the alignments, m; empty if none can be computed.
std::optional<double> best_rmse_m(const TrajectoryPair& pair, const AlignmentChoice& choice) {
  std::optional<double> best;
  for (const Alignment alignment : {choice.alignment, Alignment::scale, Alignment::se3, Alignment::sim3}) {
    if (const auto found = aligned_agreement(pair, choice.with(alignment)))
      best = std::min(best.value_or(found->rmse_m()), found->rmse_m());
  }
  return best;
}

/// Rotation vectors of all steps of `k` poses in the body's axes, of both sides.
struct StepRotations {
  std::vector<Eigen::Vector3d> reference, estimate;
};
StepRotations rotations_over(const TrajectoryPair& pair, size_t k) {
  StepRotations out;
  for_each_step(pair, k, 1, [&](const RelativePose& r, const RelativePose& e) {
    out.reference.push_back(so3_log(Eigen::Quaterniond(r.rotation)));
    out.estimate.push_back(so3_log(Eigen::Quaterniond(e.rotation)));
  });
  return out;
}

double median_length(const std::vector<Eigen::Vector3d>& vectors) {
  std::vector<double> lengths;
  for (const Eigen::Vector3d& v : vectors) lengths.push_back(v.norm());
  return upper_median(lengths);
}

/// Returns true if the estimate follows the reference over pieces of a hundredth of the path: directions of
/// motion in the body's axes, and rotations. An odometry that drifts does, however large its errors become.
bool agrees_over_pieces(const TrajectoryPair& pair) {
  constexpr double least_cosine = 0.95, least_correlation = 0.8, small_rad = 1 * degree;
  if (!pair.has_rotations()) return false;
  double cosines = 0, n_cosines = 0, rr = 0, ee = 0, re = 0, n = 0;
  for_each_piece(pair, [&](const RelativePose& r, const RelativePose& e) {
    if (const double lengths = r.translation_m.norm() * e.translation_m.norm(); lengths > 0) {
      cosines += r.translation_m.dot(e.translation_m) / lengths;
      ++n_cosines;
    }
    const Eigen::Vector3d a = so3_log(Eigen::Quaterniond(r.rotation)),
                          b = so3_log(Eigen::Quaterniond(e.rotation));
    rr += a.squaredNorm();
    ee += b.squaredNorm();
    re += a.dot(b);
    ++n;
  });
  const bool rotations_agree =
      re > least_correlation * std::sqrt(rr * ee) || rr + ee - 2 * re <= small_rad * small_rad * n;
  return cosines > least_cosine * n_cosines && rotations_agree;
}

/// Warns of rotations over pieces of the path that are much larger than those of the reference, however well
/// the positions agree.
std::optional<DataWarning> warning_of_large_rotations(const TrajectoryPair& pair) {
  constexpr double least_rad = 10 * degree, least_times = 2;
  const size_t k = std::max<size_t>(1, pair.size() / 100);
  const StepRotations rotations = rotations_over(pair, k);
  const double true_rad = median_length(rotations.reference),
               estimated_rad = median_length(rotations.estimate);
  if (estimated_rad < std::max(least_rad, least_times * true_rad)) return std::nullopt;
  return DataWarning{
      "large_rotations",
      fmt::format(
          "in {} the estimate turns by {:.3g} deg in the median, the reference by {:.3g} deg: are its "
          "angles degrees that were read as radians, or are its rotations of another recording?",
          k > 1 ? "a hundredth of the path" : "one step", degrees(estimated_rad), degrees(true_rad))};
}

/// Warns of a coordinate that has the same value in all poses of the estimate, if the motion of the reference
/// along it explains most of the squared position errors that the alignment leaves.
std::optional<DataWarning> warning_of_constant_coordinate(TrajectoryPair pair,
                                                          const AlignmentChoice& choice) {
  constexpr double least_share = 0.8, small_share_of_extent = 0.01;
  std::vector<int> constant;
  for (const int axis : {0, 1, 2}) {
    if (std::ranges::all_of(pair.estimate.positions_m, [&](const Eigen::Vector3d& p) {
          return p[axis] == pair.estimate.positions_m[0][axis];
        }))
      constant.push_back(axis);
  }
  if (constant.size() != 1) return std::nullopt;
  const int axis = constant[0];
  const double value_m = pair.estimate.positions_m[0][axis];
  Eigen::Vector3d direction;
  try {
    direction =
        align(pair.estimate, pair.reference, choice.alignment, 0, choice.up).ref_from_est.rotation.col(axis);
  } catch (const Error&) {
    return std::nullopt;
  }
  const Agreement found = agreement(pair);
  double along = 0, lowest_m = INFINITY, highest_m = -INFINITY;
  for (size_t i = 0; i < pair.size(); ++i) {
    const Eigen::Vector3d& p = pair.reference.positions_m[i];
    along += std::pow(direction.dot(p - pair.estimate.positions_m[i]), 2);
    lowest_m = std::min(lowest_m, direction.dot(p));
    highest_m = std::max(highest_m, direction.dot(p));
  }
  if (along < least_share * found.squares ||
      found.rmse_m() <= small_share_of_extent * rms_extent_m(pair.reference))
    return std::nullopt;
  return DataWarning{
      "constant",
      fmt::format("the estimate's {} is {:g} m in all poses, and the reference moves by {:.3g} m along it, "
                  "which explains {:.0f} % of the squared position errors: is a column missing, or is the "
                  "estimate planar?",
                  "xyz"[axis], value_m, highest_m - lowest_m, 100 * along / found.squares)};
}

std::optional<DataWarning> warning_of_rotation_factor(const TrajectoryPair& pair) {
  constexpr double step_rad = 3 * degree, least_rad = 0.5 * degree;
  size_t k = 1;
  while (8 * k < pair.size() && rms_length(rotations_over(pair, k).reference) < step_rad) k *= 2;
  const StepRotations rotations = rotations_over(pair, k);
  std::vector<std::string> found;
  for (const int axis : {0, 1, 2}) {
    const auto about_axis = [axis](std::vector<Eigen::Vector3d> vectors) {
      for (Eigen::Vector3d& v : vectors) v = v[axis] * Eigen::Vector3d::Unit(axis);
      return vectors;
    };
    const auto factor =
        wrong_factor(about_axis(rotations.reference), about_axis(rotations.estimate), least_rad);
    if (factor) found.push_back(fmt::format("{} {}", "xyz"[axis], factor -> text()));
  }
  if (found.empty()) return std::nullopt;
  return DataWarning{
      "rotation_factor",
      fmt::format(
          "the estimate turns about its axis {} as much as the reference: are its axes left-handed (as "
          "in Unity, Unreal and CARLA), or does another body turn?",
          fmt::join(found, ", "))};
}

}  // namespace

std::vector<DataWarning> warnings_of_disagreement(const TrajectoryPair& all, const AlignmentChoice& choice) {
  constexpr double largest_share = 0.3, least_extent_m = 0.5;
  std::vector<DataWarning> out;
  if (all.size() < fewest_explained_poses) return out;
  const TrajectoryPair pair = thinned(all);
  const auto rmse_m = best_rmse_m(pair, choice);
  const double extent_m = rms_extent_m(pair.reference);
  if (auto found = warning_of_constant_coordinate(pair, choice.with(choice.alignment))) {
    out.push_back(std::move(*found));
    return out;
  }
  if (rmse_m && extent_m >= least_extent_m && *rmse_m > largest_share * extent_m &&
      !agrees_over_pieces(pair)) {
    out.push_back(
        {"unexplained",
         fmt::format(
             "the estimate does not resemble the reference: every alignment leaves a position RMSE of "
             "{:.3g} m or more, and the RMS extent of the reference is {:.3g} m: is it of another "
             "recording, or are its poses chained or combined in the wrong way?",
             *rmse_m, extent_m)});
  }
  if (!pair.has_rotations()) return out;
  if (auto found = warning_of_large_rotations(pair)) {
    out.push_back(std::move(*found));
  } else if (auto factor = warning_of_rotation_factor(pair)) {
    out.push_back(std::move(*factor));
  }
  return out;
}

}  // namespace sextant
