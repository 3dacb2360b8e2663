#include "sextant/eval/evaluation/disagreement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/eval/diagnosis/motion_disagreement.h"

namespace sextant {
namespace {

constexpr double degree = std::numbers::pi / 180;

// ---- trajectories

/// Smallest RMSE of the alignments, m; empty if none can be computed.
std::optional<double> best_rmse_m(const PoseSeries& reference, const PoseSeries& estimate,
                                  AlignmentChoice choice) {
  std::optional<double> best;
  choice.n_to_align = 0;
  for (const Alignment alignment : {choice.alignment, Alignment::se3, Alignment::sim3}) {
    choice.alignment = alignment;
    const auto found = aligned_agreement(reference, estimate, choice);
    if (found)
      best = std::min(best.value_or(std::numeric_limits<double>::infinity()),
                      std::sqrt(found->mean_squares_m2()));
  }
  return best;
}

/// Rotation vectors of all steps of `k` poses in the body's axes.
std::vector<Eigen::Vector3d> rotations_over(const PoseSeries& series, size_t k) {
  std::vector<Eigen::Vector3d> out;
  for (size_t i = 0; i + k < series.size(); ++i)
    out.push_back(so3_log(Eigen::Quaterniond(relative_pose(series, i, i + k).rotation)));
  return out;
}

/// Returns true if the estimate follows the reference over pieces of a hundredth of the path: directions of
/// motion in the body's axes, and rotations. An odometry that drifts does, however large its errors become.
bool agrees_over_pieces(const PoseSeries& reference, const PoseSeries& estimate) {
  constexpr double least_cosine = 0.95, least_correlation = 0.8;
  if (!reference.has_rotations() || !estimate.has_rotations()) return false;
  const size_t n = reference.size(), k = std::max<size_t>(1, n / 100);
  double cosines = 0, n_cosines = 0, rr = 0, ee = 0, re = 0;
  for (size_t i = 0; i + k < n; i += k) {
    const RelativePose r = relative_pose(reference, i, i + k), e = relative_pose(estimate, i, i + k);
    if (const double lengths = r.translation_m.norm() * e.translation_m.norm(); lengths > 0) {
      cosines += r.translation_m.dot(e.translation_m) / lengths;
      ++n_cosines;
    }
    const Eigen::Vector3d a = so3_log(Eigen::Quaterniond(r.rotation)),
                          b = so3_log(Eigen::Quaterniond(e.rotation));
    rr += a.squaredNorm();
    ee += b.squaredNorm();
    re += a.dot(b);
  }
  return cosines > least_cosine * n_cosines && re > least_correlation * std::sqrt(rr * ee);
}

std::optional<TrajectoryWarning> warning_of_rotation_factor(const PoseSeries& reference,
                                                            const PoseSeries& estimate) {
  constexpr double step_rad = 3 * degree, least_rad = 0.5 * degree;
  size_t k = 1;
  while (8 * k < reference.size() && rms_length(rotations_over(reference, k)) < step_rad) k *= 2;
  const std::vector<Eigen::Vector3d> r = rotations_over(reference, k), e = rotations_over(estimate, k);
  std::vector<std::string> found;
  for (const int axis : {0, 1, 2}) {
    const auto about_axis = [axis](std::vector<Eigen::Vector3d> vectors) {
      for (Eigen::Vector3d& v : vectors) v = v[axis] * Eigen::Vector3d::Unit(axis);
      return vectors;
    };
    const auto factor = wrong_factor(about_axis(r), about_axis(e), least_rad);
    if (factor) found.push_back(fmt::format("{} {}", "xyz"[axis], factor -> text()));
  }
  if (found.empty()) return std::nullopt;
  return TrajectoryWarning{
      "rotation_factor",
      fmt::format(
          "the estimate turns about its axis {} as much as the reference: are its axes left-handed (as "
          "in Unity, Unreal and CARLA), or does another body turn?",
          fmt::join(found, ", "))};
}

// ---- objects

/// Estimated motions with their truth; without those that a lost object has as the identity, which are
/// reported by themselves.
MotionData matched_motions(const ObjectLog& log) {
  const Trajectory& camera = holds_poses(log.true_camera) ? log.true_camera : log.camera;
  const std::map<int, std::vector<int>> lost = identity_steps(log);
  MotionData data{log.frame, {}, {}};
  for (const auto& [key, motion] : log.motions) {
    const auto frames = lost.find(key.first);
    if (frames != lost.end() && std::ranges::binary_search(frames->second, key.second)) continue;
    MotionSample sample{key,
                        motion.estimate,
                        {},
                        find_pose(log.true_poses, previous(key)),
                        camera.pose(key.second - 1),
                        camera.pose(key.second)};
    std::optional<SE3> truth = motion.truth;
    const auto H = world_step(log.true_poses, key);
    if (!truth && H && !log.resting.contains(key))
      truth = change_frame(*H, MotionFrame::world, log.frame, sample);
    if (!truth) continue;
    sample.reference = *truth;
    data.samples.push_back(std::move(sample));
  }
  return data;
}

/// Reports poses of objects whose axes are turned by one rotation against the true ones.
std::optional<LogDiagnosis> diagnose_object_axes(const ObjectLog& log) {
  constexpr double least_rad = 20 * degree, scatter_rad = 10 * degree;
  std::vector<Eigen::Matrix3d> turns;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const auto& [key, pose] : log.poses) {
    const auto truth = find_pose(log.true_poses, key);
    if (!truth) continue;
    turns.push_back((pose.rotation().conjugate() * truth->rotation()).toRotationMatrix());
    sum += turns.back();
  }
  if (turns.size() < fewest_vectors) return std::nullopt;
  const Eigen::Matrix3d B = nearest_rotation(sum);
  const auto angle = [](const Eigen::Matrix3d& R) { return rotation_angle_rad(Eigen::Quaterniond(R)); };
  double squares = 0;
  for (const Eigen::Matrix3d& turn : turns)
    squares += std::pow(angle(B.transpose() * turn), 2) / static_cast<double>(turns.size());
  if (angle(B) < least_rad || std::sqrt(squares) > scatter_rad) return std::nullopt;
  const Eigen::AngleAxisd turn(B);
  const Eigen::Vector3d axis = turn.axis();
  return LogDiagnosis{
      "object_axes",
      fmt::format(
          "{}, estimated poses of objects: their axes are turned by {:.0f} deg against the true ones, "
          "the same within {:.1f} deg: errors of the poses (APE, RPE, errors per axis) depend on the "
          "axes. Turn each pose from the right by {:.4g} deg about its own axis [{:.3f} {:.3f} {:.3f}]",
          log.estimator, turn.angle() / degree, std::sqrt(squares) / degree, turn.angle() / degree, axis.x(),
          axis.y(), axis.z())};
}

}  // namespace

std::vector<TrajectoryWarning> warnings_of_disagreement(const PoseSeries& all_reference,
                                                        const PoseSeries& all_estimate,
                                                        const AlignmentChoice& choice) {
  constexpr double largest_share = 0.3, least_extent_m = 0.5;
  std::vector<TrajectoryWarning> out;
  if (all_estimate.size() < fewest_explained_poses) return out;
  const PoseSeries reference = thinned(all_reference), estimate = thinned(all_estimate);
  const auto rmse_m = best_rmse_m(reference, estimate, choice);
  const double extent_m = rms_extent_m(reference);
  if (rmse_m && extent_m >= least_extent_m && *rmse_m > largest_share * extent_m &&
      !agrees_over_pieces(reference, estimate)) {
    out.push_back(
        {"unexplained",
         fmt::format(
             "the estimate does not resemble the reference: every alignment leaves a position RMSE of "
             "{:.3g} m or more, and the RMS extent of the reference is {:.3g} m: is it of another "
             "recording, or are its poses chained or combined in the wrong way?",
             *rmse_m, extent_m)});
  }
  if (!reference.has_rotations() || !estimate.has_rotations()) return out;
  if (auto found = warning_of_rotation_factor(reference, estimate)) out.push_back(std::move(*found));
  return out;
}

std::vector<LogDiagnosis> diagnose_disagreement(const ObjectLog& log) {
  std::vector<LogDiagnosis> out;
  for (const Disagreement& found : disagreements_of(matched_motions(log)))
    out.push_back({found.code, fmt::format("{}, estimated motions: {}", log.estimator, found.text)});
  if (out.empty()) {
    if (auto found = diagnose_object_axes(log)) out.push_back(std::move(*found));
  }
  return out;
}

}  // namespace sextant
