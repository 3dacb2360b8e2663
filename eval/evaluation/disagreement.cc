#include "sextant/eval/evaluation/disagreement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/eval/diagnosis/motion_readings.h"
#include "sextant/geometry/object_motion.h"

namespace sextant {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr size_t fewest_vectors = 10;

double rms(std::span<const Eigen::Vector3d> vectors) {
  double squares = 0;
  for (const Eigen::Vector3d& v : vectors) squares += v.squaredNorm();
  return std::sqrt(squares / static_cast<double>(vectors.size()));
}

/// Returns the factor if it is reported. A truth below `least_rms` may be mostly noise, which makes the
/// factor smaller, but not negative.
std::optional<MotionFactor> wrong_factor(std::span<const Eigen::Vector3d> truth,
                                         std::span<const Eigen::Vector3d> estimate, double least_rms) {
  constexpr double lowest = 0.6, highest = 1.6, negative = -0.3, n_errors = 4;
  const auto found = motion_factor(truth, estimate);
  if (!found) return std::nullopt;
  const bool is_clear = rms(truth) >= least_rms;
  const double reach = n_errors * found->standard_error;
  const bool differs =
      found->factor + reach < (is_clear ? lowest : negative) || (is_clear && found->factor - reach > highest);
  return differs ? found : std::nullopt;
}

std::string factor_text(const MotionFactor& found) {
  return fmt::format("{:.3g} +- {:.2g} times", found.factor, found.standard_error);
}

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
  while (8 * k < reference.size() && rms(rotations_over(reference, k)) < step_rad) k *= 2;
  const std::vector<Eigen::Vector3d> r = rotations_over(reference, k), e = rotations_over(estimate, k);
  std::vector<std::string> found;
  for (const int axis : {0, 1, 2}) {
    const auto about_axis = [axis](std::vector<Eigen::Vector3d> vectors) {
      for (Eigen::Vector3d& v : vectors) v = v[axis] * Eigen::Vector3d::Unit(axis);
      return vectors;
    };
    const auto factor = wrong_factor(about_axis(r), about_axis(e), least_rad);
    if (factor) found.push_back(fmt::format("{} {}", "xyz"[axis], factor_text(*factor)));
  }
  if (found.empty()) return std::nullopt;
  return TrajectoryWarning{
      "rotation_factor",
      fmt::format(
          "the estimate turns about its axis {} as much as the reference: are its axes left-handed (as "
          "in Unity, Unreal and CARLA), or its rotations those of another body?",
          fmt::join(found, ", "))};
}

// ---- objects

/// Motion of an object from frame k-1 to k in its own frame, with the rotations in the axes of the world.
struct ObjectStep {
  ObjectFrame key;
  Eigen::Vector3d true_m, estimated_m, true_rad, estimated_rad;
  std::optional<Eigen::Vector3d> camera_rad;  ///< rotation of the camera
};

std::vector<ObjectStep> object_steps(const ObjectLog& log) {
  const Trajectory& camera = holds_poses(log.true_camera) ? log.true_camera : log.camera;
  const std::map<int, std::vector<int>> lost = identity_steps(log);  // reported by themselves
  std::vector<ObjectStep> steps;
  for (const auto& [key, motion] : log.motions) {
    const auto frames = lost.find(key.first);
    if (frames != lost.end() && std::ranges::binary_search(frames->second, key.second)) continue;
    const auto L = find_pose(log.true_poses, previous(key));
    if (log.frame != MotionFrame::body && !L) continue;
    const auto in_body = [&](const SE3& logged) {
      return log.frame == MotionFrame::body ? logged : body_motion(logged, *L);
    };
    std::optional<SE3> truth;
    if (motion.truth) {
      truth = in_body(*motion.truth);
    } else if (const auto H = world_step(log.true_poses, key); H && !log.resting.contains(key)) {
      truth = body_motion(*H, *L);
    }
    if (!truth) continue;
    const SE3 estimate = in_body(motion.estimate);
    const Eigen::Quaterniond to_world = L ? L->rotation() : Eigen::Quaterniond::Identity();
    ObjectStep step{key,
                    truth->translation(),
                    estimate.translation(),
                    to_world * so3_log(truth->rotation()),
                    to_world * so3_log(estimate.rotation()),
                    std::nullopt};
    const auto before = camera.pose(key.second - 1), after = camera.pose(key.second);
    if (L && before && after) step.camera_rad = so3_log(after->rotation() * before->rotation().conjugate());
    steps.push_back(std::move(step));
  }
  return steps;
}

/// Adds a vector of the steps over up to eight successive frames of an object; leaves out steps without it.
template <typename VectorOf>
std::vector<Eigen::Vector3d> sums_over_frames(const std::vector<ObjectStep>& steps,
                                              const VectorOf& vector_of) {
  constexpr size_t most = 8, wanted_sums = 20;
  const size_t n = std::clamp<size_t>(steps.size() / wanted_sums, 1, most);
  std::vector<Eigen::Vector3d> sums;
  size_t n_added = n;
  for (size_t i = 0; i < steps.size(); ++i) {
    const bool continues = i > 0 && steps[i - 1].key == previous(steps[i].key);
    if (n_added == n || !continues) {
      sums.push_back(Eigen::Vector3d::Zero());
      n_added = 0;
    }
    ++n_added;
    sums.back() += vector_of(steps[i]);
  }
  return sums;
}

/// Reports translations that agree with the true ones little better than if every object stood still.
std::optional<LogDiagnosis> diagnose_translations(const std::vector<ObjectStep>& steps,
                                                  const std::string& name) {
  constexpr double least_m = 0.1, largest_share = 0.5;
  std::vector<double> errors_m2, motions_m2;
  for (const ObjectStep& step : steps) {
    if (step.true_m.norm() < least_m) continue;
    errors_m2.push_back((step.estimated_m - step.true_m).squaredNorm());
    motions_m2.push_back(step.true_m.squaredNorm());
  }
  const auto error_m2 = trimmed_mean(errors_m2, fewest_vectors);
  const auto motion_m2 = trimmed_mean(motions_m2, fewest_vectors);
  if (!error_m2 || *error_m2 <= largest_share * *motion_m2) return std::nullopt;
  return LogDiagnosis{
      "unexplained",
      fmt::format(
          "{}, estimated motions: in their own frames the objects are off by {:.3g} m a frame (RMS, without "
          "the largest fifth), although they move by {:.3g} m only: are the translations in another "
          "unit or frame, over another number of frames, or of another recording?",
          name, std::sqrt(*error_m2), std::sqrt(*motion_m2))};
}

std::optional<LogDiagnosis> diagnose_large_rotations(const ObjectLog& log) {
  constexpr double largest_rad = 45 * degree, least_share = 0.1;
  constexpr size_t fewest = 3;
  size_t n = 0;
  for (const auto& [key, motion] : log.motions)
    n += rotation_angle_rad(motion.estimate.rotation()) > largest_rad;
  if (n < fewest || static_cast<double>(n) < least_share * static_cast<double>(log.motions.size()))
    return std::nullopt;
  return LogDiagnosis{
      "large_rotations",
      fmt::format("{}, estimated motions: {} of {} turn an object by more than 45 deg from one frame to the "
                  "next: are its angles degrees that were read as radians, or do headings flip by 180 deg?",
                  log.estimator, n, log.motions.size())};
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

std::optional<MotionFactor> motion_factor(std::span<const Eigen::Vector3d> truth,
                                          std::span<const Eigen::Vector3d> estimate) {
  SEXTANT_CHECK(truth.size() == estimate.size());
  constexpr size_t n_stretches = 10;
  if (truth.size() < fewest_vectors) return std::nullopt;
  struct Sums {
    double et = 0, tt = 0;
  };
  std::array<Sums, n_stretches> stretches;
  Sums all;
  for (size_t i = 0; i < truth.size(); ++i) {
    Sums& stretch = stretches[i * n_stretches / truth.size()];
    for (Sums* sums : {&stretch, &all}) {
      sums->et += estimate[i].dot(truth[i]);
      sums->tt += truth[i].squaredNorm();
    }
  }
  if (!(all.tt > 0)) return std::nullopt;
  MotionFactor out{.factor = all.et / all.tt};
  double squares = 0;
  for (const Sums& without : stretches) {
    if (!(all.tt - without.tt > 1e-9 * all.tt)) return MotionFactor{out.factor, INFINITY};
    squares += std::pow((all.et - without.et) / (all.tt - without.tt) - out.factor, 2);
  }
  out.standard_error = std::sqrt(squares * (n_stretches - 1) / n_stretches);
  return out;
}

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
  constexpr double least_m = 0.1, least_rad = 1 * degree, most_of_camera = 0.4, n_errors = 4;
  if (auto found = diagnose_large_rotations(log)) return {*found};
  std::vector<LogDiagnosis> out;
  const std::string subject = log.estimator + ", estimated motions";
  std::vector<ObjectStep> steps = object_steps(log);
  const auto sums = [&](auto vector_of) { return sums_over_frames(steps, vector_of); };
  const auto true_rad = [](const ObjectStep& step) { return step.true_rad; };
  const auto estimated_rad = [](const ObjectStep& step) { return step.estimated_rad; };
  const auto of_translations =
      wrong_factor(sums([](const ObjectStep& step) { return step.true_m; }),
                   sums([](const ObjectStep& step) { return step.estimated_m; }), least_m);
  const auto of_rotations = wrong_factor(sums(true_rad), sums(estimated_rad), least_rad);
  if (of_translations) {
    out.push_back(
        {"translation_factor",
         fmt::format("{}: the translations are {} the true ones, in the objects' own frames: are they "
                     "in another unit or frame, or over another number of frames?",
                     subject, factor_text(*of_translations))});
  } else if (auto found = diagnose_translations(steps, log.estimator)) {
    out.push_back(std::move(*found));
  }
  if (of_rotations) {
    out.push_back(
        {"rotation_factor", fmt::format("{}: the rotations are {} the true ones: do the headings have "
                                        "the opposite sign, or are there none?",
                                        subject, factor_text(*of_rotations))});
  }
  std::erase_if(steps, [](const ObjectStep& step) { return !step.camera_rad; });
  const std::vector<Eigen::Vector3d> camera_rad =
      sums([](const ObjectStep& step) { return *step.camera_rad; });
  const auto of_camera = camera_rad.empty() || rms(camera_rad) < least_rad
                             ? std::nullopt
                             : motion_factor(camera_rad, sums([&](const ObjectStep& step) -> Eigen::Vector3d {
                                               return step.estimated_rad - step.true_rad;
                                             }));
  if (of_camera && std::abs(of_camera->factor) - n_errors * of_camera->standard_error > most_of_camera) {
    out.push_back(
        {"camera_rotation",
         fmt::format("{}: their errors of rotation are {} the rotation of the camera: are headings given "
                     "against the camera or the line of sight (KITTI's alpha), with the opposite "
                     "sign, or not at all?",
                     subject, factor_text(*of_camera))});
  }
  if (out.empty()) {
    if (auto found = diagnose_object_axes(log)) out.push_back(std::move(*found));
  }
  return out;
}

}  // namespace sextant
