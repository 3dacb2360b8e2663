#include "sextant/eval/evaluation/trajectory_explanation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include "sextant/base/error.h"
#include "sextant/eval/diagnosis/trajectory_hypotheses.h"
#include "sextant/eval/evaluation/body_offset.h"
#include "sextant/geometry/axes.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {
namespace {

std::string numbers(const Eigen::Vector3d& v) {
  return fmt::format("{:.3f} {:.3f} {:.3f}", v[0], v[1], v[2]);
}

/// Formats a matrix as "[1 0 0; 0 0 -1; 0 1 0]".
std::string matrix_text(const Eigen::Matrix3d& M) {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    text += i == 0 ? "[" : "; ";
    for (int j = 0; j < 3; ++j)
      text += fmt::format("{}{:.3g}", j == 0 ? "" : " ", std::abs(M(i, j)) < 5e-4 ? 0 : M(i, j));
  }
  return text + "]";
}

double percent(double before, double after) { return 100 * (1 - after / before); }

// ---- constant pose of the camera in the body

std::optional<DataWarning> lever_arm(const TrajectoryPair& pair, const AlignmentChoice& choice,
                                     const PoseFrame& frame, const Agreement& now) {
  constexpr double shortest_m = 0.05, longest_m = 100;
  const auto l = estimate_lever_arm(pair);
  if (!l || l->norm() < shortest_m || l->norm() > longest_m) return std::nullopt;
  const auto then = aligned_agreement(at_lever_arm(pair, *l), choice);
  // A longer lever arm, as of an orbit, is nearly equivalent to a translation or a scale, so it must explain
  // as much as another convention.
  constexpr double share_of_extent = 0.1;
  const bool is_short = l->norm() < share_of_extent * rms_extent_m(pair.reference);
  if (!then || then->squares > (is_short ? largest_left_share : 1 / explains_times) * now.squares)
    return std::nullopt;
  const auto scaled = is_short ? std::nullopt : aligned_agreement(pair, choice.with(Alignment::sim3));
  if (scaled && then->squares > largest_left_share * scaled->squares) return std::nullopt;
  const Eigen::Matrix4d T = frame.matrix();
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const Eigen::Vector3d total = T.topRightCorner<3, 1>() + R * *l;
  const bool has_rotation = frame.body_from_camera && frame.body_from_camera->rotation;
  return DataWarning{
      "lever_arm",
      fmt::format(
          "a constant lever arm of {:.2f} m explains {:.0f} % of the squared errors: the estimate's poses "
          "may be of another point of the body; try --body-from-camera {} ({} of the camera in the "
          "body, m; what the turns do not determine is 0)",
          l->norm(), percent(now.squares, then->squares),
          has_rotation ? body_from_camera_numbers(R, total) : "\"" + numbers(total) + "\"",
          has_rotation ? "pose" : "position")};
}

std::optional<DataWarning> body_rotation(const TrajectoryPair& pair, const PoseFrame& frame) {
  constexpr double least_deg = 0.5;
  const auto found = estimate_body_rotation(pair);
  if (!found || found->squares_with > largest_left_share * found->squares_without) return std::nullopt;
  const double angle_deg = degrees(rotation_angle_rad(found->body_from_camera));
  if (angle_deg < least_deg) return std::nullopt;
  const Eigen::Matrix4d T = frame.matrix();
  return DataWarning{
      "body",
      fmt::format(
          "a constant rotation of the body by {:.1f} deg explains {:.0f} % of the squared errors of relative "
          "translations: the estimate's poses may be of a body that is turned against the camera; try "
          "--body-from-camera {} (a turn about the direction of motion stays unknown)",
          angle_deg, percent(found->squares_without, found->squares_with),
          body_from_camera_numbers(T.topLeftCorner<3, 3>() * found->body_from_camera,
                                   T.topRightCorner<3, 1>()))};
}

// ---- yaw

std::optional<DataWarning> yaw(const TrajectoryPair& pair, const AlignmentChoice& choice) {
  constexpr double least_deg = 3;
  if (choice.alignment != Alignment::none && choice.alignment != Alignment::scale) return std::nullopt;
  TrajectoryPair shifted = pair;
  const Eigen::Vector3d shift = mean_position(pair.reference) - mean_position(pair.estimate);
  for (Eigen::Vector3d& p : shifted.estimate.positions_m) p += shift;
  const Agreement now = agreement(shifted);

  std::vector<std::pair<std::string, Eigen::Vector3d>> axes = {
      {"x", Eigen::Vector3d::UnitX()}, {"-y", -Eigen::Vector3d::UnitY()}, {"z", Eigen::Vector3d::UnitZ()}};
  std::optional<DataWarning> best;
  double least = largest_left_share * now.squares;
  for (const auto& [name, axis] : axes) {
    const auto turn = rotation_about(axis, pair.estimate.positions_m, pair.reference.positions_m);
    if (!turn) continue;
    TrajectoryPair turned = pair;
    const double angle_deg = degrees(rotation_angle_rad(turn->rotation));
    align(turned.estimate, turned.reference, Alignment::yaw, 0, axis);
    const Agreement then = agreement(turned);
    if (angle_deg < least_deg || then.squares > least || then.angle_deg > largest_left_share * now.angle_deg)
      continue;
    least = then.squares;
    best = {"yaw",
            fmt::format(
                "a constant turn of {:.1f} deg about the {} axis explains {:.0f} % of the squared errors: "
                "the worlds may differ in heading; try --align yaw --up {}",
                angle_deg, name.back(), percent(now.squares, then.squares), name)};
  }
  return best;
}

// ---- Conventions, by the rule of hypothesis.h.

/// Squared position error over the squared extent of the path, plus the squared rotation error in rad.
double residual(const Agreement& agreement, const PoseSeries& reference, bool with_rotations) {
  constexpr double least_m = 1e-3;
  const double extent_m = std::max(rms_extent_m(reference), least_m);
  const double angle = agreement.angle_deg * std::numbers::pi / 180;
  return agreement.mean_squares_m2() / (extent_m * extent_m) + (with_rotations ? angle * angle : 0);
}
double residual(const TrajectoryPair& pair, bool with_rotations) {
  return residual(agreement(pair), pair.reference, with_rotations);
}

/// The declared rotations over pieces of the path, which a reading must not contradict: an alignment to a
/// nearly straight path may be turned about it by any angle, which another body would explain. Unlike the
/// poses, these rotations need no alignment.
class DeclaredRotations {
 public:
  explicit DeclaredRotations(const TrajectoryPair& pair)
      : known_(pair.has_rotations()), squares_(known_ ? squares_of(pair) : 0) {}

  /// Returns true if the squared errors of the read rotations are more than a tenth larger.
  bool contradict(const TrajectoryPair& read) const {
    constexpr double worse = 1.1, rounding_rad2 = 1e-10;
    return known_ && squares_of(read) > worse * squares_ + rounding_rad2;
  }

 private:
  /// Sum of the squared angles between the rotations of both sides.
  static double squares_of(const TrajectoryPair& pair) {
    double sum = 0;
    for_each_piece(pair, [&](const RelativePose& r, const RelativePose& e) {
      sum += std::pow(rotation_angle_rad(r.rotation.transpose() * e.rotation), 2);
    });
    return sum;
  }

  bool known_;
  double squares_;
};

constexpr double least_fitted_rad = 10 * degree;

/// Fits the constant rotation of the body axes, applied from the right, that is nearest to the differences of
/// all poses of the aligned pair.
std::optional<Reading> fitted_body(TrajectoryPair pair, const DeclaredRotations& rotations,
                                   const PoseFrame& frame) {
  constexpr double price = 0.6;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < pair.size(); ++i)
    sum += pair.estimate.rotations[i].transpose() * pair.reference.rotations[i];
  const Eigen::Matrix3d B = nearest_rotation(sum);
  if (is_near_axes(B, least_fitted_rad))
    return std::nullopt;  // the hypotheses about exchanged axes cover this rotation
  for (Eigen::Matrix3d& R : pair.estimate.rotations) R = R * B;
  if (rotations.contradict(pair)) return std::nullopt;
  return Reading{"body",
                 fmt::format("the estimate is of a body turned by {:.1f} deg against the camera",
                             degrees(rotation_angle_rad(B))),
                 frame.is_default() ? "give --body-from-camera " + body_from_camera_numbers(B)
                                    : "correct --body-from-camera",
                 residual(pair, true), price};
}

/// Fits the constant rotation of the world of the rotations alone, applied from the left, to the aligned
/// pair. The positions must contradict this rotation: along a line, they do not determine the world's
/// rotation about it. `first_given` is the first rotation of the estimate before the alignment.
std::optional<Reading> fitted_world_of_rotations(TrajectoryPair pair, const Eigen::Matrix3d& first_given) {
  constexpr double price = 0.7, contradicted = 0.05;
  PoseSeries& estimate = pair.estimate;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < estimate.size(); ++i)
    sum += pair.reference.rotations[i] * estimate.rotations[i].transpose();
  const Eigen::Matrix3d C = nearest_rotation(sum);
  const double angle = rotation_angle_rad(C);
  if (angle < least_fitted_rad) return std::nullopt;
  const Eigen::Matrix3d aligned_from_file = estimate.rotations[0] * first_given.transpose();
  TrajectoryPair turned = pair;
  const Eigen::Vector3d mean = mean_position(estimate);
  for (Eigen::Vector3d& p : turned.estimate.positions_m) p = mean + C * (p - mean);
  if (residual(turned, false) < contradicted) return std::nullopt;
  for (Eigen::Matrix3d& R : estimate.rotations) R = C * R;
  const Eigen::Matrix3d of_file = aligned_from_file.transpose() * C * aligned_from_file;
  return Reading{
      "world_of_rotations",
      fmt::format("the estimate's rotations are in another world than its positions, turned by "
                  "{:.1f} deg",
                  degrees(angle)),
      fmt::format(
          "write both in the same axes: multiply each rotation from the left by {}, or turn the positions",
          matrix_text(of_file)),
      residual(pair, true), price};
}

bool is_of_estimate(const Reading& reading) { return reading.cause.starts_with("the estimate"); }

/// Returns the length of the declared path divided by the length of the path of the inverted poses, which
/// does not depend on the scale. Inverted camera poses have a longer path than the camera itself.
double path_ratio_to_inverse(const PoseSeries& poses) {
  PoseSeries inverted = poses;
  invert(inverted);
  return path_in_pieces_m(poses) / path_in_pieces_m(inverted);
}

/// Returns true if the reference rather than the estimate looks wrong by itself.
bool reference_looks_wrong(const std::string& code, const TrajectoryPair& pair) {
  constexpr double least_ratio = 1.02;
  const bool reference = explain_alone(pair.reference).has_value();
  const bool estimate = explain_alone(pair.estimate).has_value();
  if (reference != estimate) return reference;
  return code == "inverse" && path_ratio_to_inverse(pair.reference) > least_ratio &&
         path_ratio_to_inverse(pair.reference) > path_ratio_to_inverse(pair.estimate);
}

/// Chooses between the readings of the estimate and of the reference that have the code of the best one: the
/// side that looks wrong by itself is blamed, and the other one is named as well. If the poses of one side
/// are inverse, transposed or have exchanged columns, the same reading of the other side makes both agree,
/// too, but with another residual, because it changes the extent of the path. For these codes it suffices
/// that both readings explain the pair by the rule of hypothesis.h.
Reading chosen(const Explanation& found, const std::vector<Reading>& readings, const TrajectoryPair& pair) {
  const std::string& code = found.best.code;
  const bool has_mirror_image = code == "inverse" || code == "columns" || code == "transposed";
  const Reading* other = nullptr;
  for (const Reading& reading : has_mirror_image ? readings : found.alike) {
    if (reading.code != code || is_of_estimate(reading) == is_of_estimate(found.best)) continue;
    if (explains_times * reading.residual > found.declared) continue;
    if (!other || reading.residual < other->residual) other = &reading;
  }
  if (!other) return found.best;
  const bool of_reference = reference_looks_wrong(code, pair);
  const bool keeps_best = of_reference != is_of_estimate(found.best);
  Reading best = keeps_best ? found.best : *other;
  const Reading& second = keeps_best ? *other : found.best;
  best.remedy += fmt::format("; the other way round, {}: {}", second.cause, second.remedy);
  return best;
}

std::string agreement_text(const Agreement& a, bool with_rotations) {
  std::string text = fmt::format("position RMSE {:.3g} m", a.rmse_m());
  if (with_rotations) text += fmt::format(", mean rotation error {:.1f} deg", a.angle_deg);
  return text;
}

// 3 % of the squares: 17 % of the extent, or 10 deg
constexpr double negligible = 0.03;

/// Returns true if an aligned pair agrees, apart from a turn about the path of which a short or straight path
/// leaves no more than four times the squared position errors.
bool agrees(TrajectoryPair pair, const AlignmentChoice& choice) {
  constexpr double undetermined = 4;
  const Agreement now = agreement(pair);
  if (residual(now, pair.reference, pair.has_rotations()) <= negligible) return true;
  if (!pair.has_rotations() || !choice.turns_world()) return false;
  turn_about_path(pair);
  return agreement(pair).squares <= undetermined * now.squares && residual(pair, true) <= negligible;
}

/// Explains the errors `now` that an alignment leaves, which need not be the `given` one.
std::optional<DataWarning> convention_after(const TrajectoryPair& pair, const AlignmentChoice& choice,
                                            const Agreement& now, Alignment given, const PoseFrame& frame,
                                            const PoseFrame& reference_frame) {
  constexpr double explained = 0.05;
  const bool rotations = pair.has_rotations();
  const double declared = residual(now, pair.reference, rotations);
  const DeclaredRotations declared_rotations(pair);
  const auto residual_of = [&](const TrajectoryPair& read) -> std::optional<double> {
    if (declared_rotations.contradict(read)) return std::nullopt;
    const auto then = aligned_agreement(read, choice);
    if (!then) return std::nullopt;
    return residual(*then, read.reference, rotations);
  };
  std::vector<Reading> readings =
      read_as(trajectory_hypotheses({!frame.is_default(), !reference_frame.is_default(), choice.turns_world(),
                                     choice.scales()}),
              pair, residual_of);
  if (const auto whole = rotations ? aligned(pair, choice) : std::nullopt) {
    if (auto body = fitted_body(*whole, declared_rotations, frame)) readings.push_back(*body);
    if (auto world = fitted_world_of_rotations(*whole, pair.estimate.rotations[0]))
      readings.push_back(*world);
  }
  std::erase_if(readings, [](const Reading& reading) { return reading.residual > explained; });
  auto found = explain(declared, readings, {.negligible = negligible});
  if (!found) return std::nullopt;
  // Along a nearly level path, a mirrored one resembles other axes or columns; then the residual decides.
  const auto mirrored = std::ranges::min_element(found->alike, {}, [](const Reading& reading) {
    return std::tuple(reading.code != "mirrored", reading.price, reading.residual);
  });
  if (mirrored != found->alike.end() && mirrored->code == "mirrored" && found->best.code != "mirrored" &&
      mirrored->residual < found->best.residual)
    std::swap(found->best, *mirrored);
  const Reading best = chosen(*found, readings, pair);
  std::string others;
  std::set<std::string> named = {best.code};
  for (const Reading& other : found->alike) {
    constexpr size_t most = 3;
    const bool same_side = is_of_estimate(other) == is_of_estimate(best);
    if (same_side && named.size() < most && named.insert(other.code).second)
      others += fmt::format("; or {}: {}", other.cause, other.remedy);
  }
  std::string with;
  if (choice.alignment != given) with = fmt::format(", with --align {}", to_string(choice.alignment));
  return DataWarning{
      best.code,
      fmt::format("{}: {}{}{} (declared reading{}: {}; read so, the squared error is {:.3g} times smaller)",
                  best.cause, best.remedy, with, others, with, agreement_text(now, rotations),
                  declared / std::max(best.residual, 1e-12 * declared))};
}

std::optional<DataWarning> convention(const TrajectoryPair& pair, const AlignmentChoice& choice,
                                      const PoseFrame& frame, const PoseFrame& reference_frame) {
  std::vector<Alignment> tried = {choice.alignment};
  if (!choice.turns_world()) tried.push_back(Alignment::se3);
  if (choice.alignment != Alignment::sim3) tried.push_back(Alignment::sim3);
  for (const Alignment alignment : tried) {
    const AlignmentChoice other = choice.with(alignment);
    const auto declared = aligned(thinned(pair), other);
    if (!declared) continue;
    if (agrees(*declared, other)) return std::nullopt;
    if (auto found =
            convention_after(pair, other, agreement(*declared), choice.alignment, frame, reference_frame))
      return found;
  }
  return std::nullopt;
}

/// Examines each side alone, and warns if both have the same mistake.
std::optional<DataWarning> both_alone(const TrajectoryPair& pair) {
  const auto a = explain_alone(pair.reference);
  if (!a) return std::nullopt;
  const auto b = explain_alone(pair.estimate);
  if (!b || a->best.code != b->best.code) return std::nullopt;
  const auto text_of = [](const std::string& code) {
    return code == "inverse" ? "hold inverse poses, T_camera_world: give --inverse and --ref-inverse"
           : code == "transposed"
               ? "hold transposed rotations: transpose the rotation of each line"
               : "have quaternions with w at the other end: check the order of the columns";
  };
  std::string what = text_of(a->best.code);
  std::set<std::string> named = {a->best.code};
  for (const Reading& other : a->alike) {
    if (named.insert(other.code).second) what += fmt::format("; or to {}", text_of(other.code));
  }
  return DataWarning{
      a->best.code,
      fmt::format(
          "both files seem to {} (the reference moves along one direction of its own axes within {:.1f} deg "
          "when read so, {:.1f} deg as declared; the estimate within {:.1f} and {:.1f} deg)",
          what, std::sqrt(a->best.residual), std::sqrt(a->declared), std::sqrt(b->best.residual),
          std::sqrt(b->declared))};
}

}  // namespace

std::optional<DataWarning> warning_of_alignment_kind(const TrajectoryPair& all,
                                                     const AlignmentChoice& choice) {
  constexpr double times = 10;
  if (choice.turns_world() || all.size() < 3) return std::nullopt;
  const TrajectoryPair pair = thinned(all);
  const auto rmse = [&](Alignment alignment, const Eigen::Vector3d& up) -> std::optional<double> {
    const auto found = aligned_agreement(pair, {alignment, 0, up});
    return found ? std::optional(found->rmse_m()) : std::nullopt;
  };
  const auto now = rmse(choice.alignment, choice.up);
  const auto se3 = rmse(Alignment::se3, {}), sim3 = rmse(Alignment::sim3, {});
  if (!now || !se3 || !sim3) return std::nullopt;
  std::optional<double> yaw;
  std::string up;
  for (const auto& [name, direction] : {std::pair("z", Eigen::Vector3d(Eigen::Vector3d::UnitZ())),
                                        std::pair("-y", Eigen::Vector3d(-Eigen::Vector3d::UnitY()))}) {
    const auto found = rmse(Alignment::yaw, direction);
    if (found && (!yaw || *found < *yaw)) {
      yaw = found;
      up = name;
    }
  }
  double extent = 0;
  for (const Eigen::Vector3d& p : pair.reference.positions_m)
    extent = std::max(extent, (p - pair.reference.positions_m[0]).norm());
  // A scale within 10 % is an error of the estimate, which sim3 would hide.
  const auto u = umeyama(pair.estimate.positions_m, pair.reference.positions_m, true);
  const bool rescales = u && std::abs(std::log(u->y_from_x.scale)) > std::log(1.1);
  const double least = std::min({*se3, rescales ? *sim3 : *se3, yaw.value_or(*se3)});
  if (*now <= times * least || *now <= 1e-4 * extent) return std::nullopt;
  std::string text =
      fmt::format("--align {} leaves an RMSE of {:.3g} m; --align se3 would leave {:.3g} m, sim3 {:.3g} m",
                  to_string(choice.alignment), *now, *se3, *sim3);
  if (yaw) text += fmt::format(", yaw --up {} {:.3g} m", up, *yaw);
  return DataWarning{"alignment", text + ": are both in one world?"};
}

std::vector<DataWarning> warnings_of_explanations(const TrajectoryPair& all, const AlignmentChoice& choice,
                                                  const PoseFrame& frame, const PoseFrame& reference_frame) {
  if (all.size() < fewest_explained_poses) return {};
  const TrajectoryPair some = thinned(all);
  const AlignmentChoice of_all = choice.with(choice.alignment);
  const auto now = aligned_agreement(some, of_all);
  if (!now) return {};
  // With wrong axes nothing else can be judged. Steps are chained before poses are left out.
  constexpr size_t most_poses = 20'000;
  if (auto found = convention(all.size() <= most_poses ? all : some, of_all, frame, reference_frame))
    return {*found};
  if (!all.has_rotations() || !(now->squares > 0)) return {};
  if (auto found = both_alone(all)) return {*found};
  std::vector<DataWarning> out;
  if (auto found = yaw(some, of_all)) out.push_back(*found);
  if (auto found = lever_arm(some, of_all, frame, *now)) {
    out.push_back(*found);
  } else if (auto turned = body_rotation(all, frame)) {
    out.push_back(*turned);
  }
  return out;
}

}  // namespace sextant
