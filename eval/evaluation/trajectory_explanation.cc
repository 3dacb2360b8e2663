#include "sextant/eval/evaluation/trajectory_explanation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sextant/base/error.h"
#include "sextant/eval/evaluation/trajectory_offset.h"
#include "sextant/geometry/axes.h"
#include "sextant/geometry/pose_interpolation.h"

namespace sextant {
namespace {

constexpr size_t fewest = 10;
constexpr double most = 0.5;  // "most of the error": of the sum of squares

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

/// Every n-th pose, at most 1000: enough for one constant.
PoseSeries thinned(PoseSeries series) {
  constexpr size_t enough = 1000;
  const size_t every = (series.size() + enough - 1) / enough;
  std::vector<int> kept;
  for (size_t i = 0; i < series.size(); i += every) kept.push_back(static_cast<int>(i));
  series.keep(kept);
  return series;
}

/// How well two paths agree.
struct Agreement {
  double squares = 0;    ///< sum of squared distances, m^2
  double angle_deg = 0;  ///< mean angle between rotations
};

Agreement agreement(const PoseSeries& reference, const PoseSeries& estimate) {
  Agreement out;
  for (size_t i = 0; i < reference.size(); ++i) {
    out.squares += (reference.positions_m[i] - estimate.positions_m[i]).squaredNorm();
    out.angle_deg += degrees(rotation_angle_rad(Eigen::Quaterniond(
                         Eigen::Matrix3d(reference.rotations[i].transpose() * estimate.rotations[i])))) /
                     static_cast<double>(reference.size());
  }
  return out;
}

/// After alignment; empty where that is not determined.
std::optional<Agreement> aligned_agreement(const PoseSeries& reference, PoseSeries estimate,
                                           const AlignmentChoice& choice) {
  try {
    align(estimate, reference, choice.alignment, choice.n_to_align, choice.up);
  } catch (const Error&) {
    return std::nullopt;
  }
  return agreement(reference, estimate);
}

std::string numbers(const Eigen::Vector3d& v) {
  return fmt::format("{:.3f} {:.3f} {:.3f}", v[0], v[1], v[2]);
}

double percent(double before, double after) { return 100 * (1 - after / before); }

// ---- lever arm

std::optional<TrajectoryWarning> lever_arm(const PoseSeries& reference, const PoseSeries& estimate,
                                           const AlignmentChoice& choice, const PoseFrame& frame,
                                           const Agreement& now) {
  constexpr double shortest_m = 0.05, longest_m = 100;
  const auto l = estimate_lever_arm(reference, estimate);
  if (!l || l->norm() < shortest_m || l->norm() > longest_m) return std::nullopt;
  PoseSeries moved = estimate;
  for (size_t i = 0; i < moved.size(); ++i) moved.positions_m[i] += moved.rotations[i] * *l;
  const auto then = aligned_agreement(reference, moved, choice);
  if (!then || then->squares > (1 - most) * now.squares) return std::nullopt;
  const Eigen::Matrix4d T = frame.matrix();
  const Eigen::Vector3d total = T.topRightCorner<3, 1>() + T.topLeftCorner<3, 3>() * *l;
  return TrajectoryWarning{
      "lever_arm",
      fmt::format(
          "a constant lever arm of {:.2f} m explains {:.0f} % of the squared errors: the estimate's poses "
          "may be of another point of the body; try --body-from-camera \"{}\" (position of the camera in the "
          "body, m; what the turns do not determine is 0)",
          l->norm(), percent(now.squares, then->squares), numbers(total))};
}

// ---- yaw

std::optional<TrajectoryWarning> yaw(const PoseSeries& reference, const PoseSeries& estimate,
                                     const AlignmentChoice& choice) {
  constexpr double least_deg = 3;
  if (choice.alignment != Alignment::none && choice.alignment != Alignment::scale) return std::nullopt;
  PoseSeries shifted = estimate;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < estimate.size(); ++i)
    shift += (reference.positions_m[i] - estimate.positions_m[i]) / static_cast<double>(estimate.size());
  for (Eigen::Vector3d& p : shifted.positions_m) p += shift;
  const Agreement now = agreement(reference, shifted);

  std::vector<std::pair<std::string, Eigen::Vector3d>> axes = {
      {"x", Eigen::Vector3d::UnitX()}, {"-y", -Eigen::Vector3d::UnitY()}, {"z", Eigen::Vector3d::UnitZ()}};
  std::optional<TrajectoryWarning> best;
  double least = (1 - most) * now.squares;
  for (const auto& [name, axis] : axes) {
    const auto turn = rotation_about(axis, estimate.positions_m, reference.positions_m);
    if (!turn) continue;
    const double angle_deg = degrees(rotation_angle_rad(Eigen::Quaterniond(turn->rotation)));
    PoseSeries turned = estimate;
    align(turned, reference, Alignment::yaw, 0, axis);
    const Agreement then = agreement(reference, turned);
    if (angle_deg < least_deg || then.squares > least || then.angle_deg > (1 - most) * now.angle_deg)
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

// ---- clock

/// Mean squared distance when the estimate's stamps are moved by `shift_s`.
std::optional<double> shifted_squares(const PoseSeries& reference, const PoseSeries& estimate, double shift_s,
                                      const AlignmentChoice& choice) {
  std::vector<double> times;
  for (const double t : estimate.stamps_s) times.push_back(t + shift_s);
  const double max_gap_s = 2 * std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s));
  const InterpolatedPoses at = interpolate_poses(reference, times, max_gap_s);
  if (at.asked.size() < fewest) return std::nullopt;
  PoseSeries matched = estimate;
  matched.keep(at.asked);
  const auto found = aligned_agreement(at.poses, std::move(matched), choice);
  if (!found) return std::nullopt;
  return found->squares / static_cast<double>(at.asked.size());
}

// ---- axes and columns

/// One of them holds a quaternion q; the same four numbers read with w at the other end.
void reorder_quaternions(PoseSeries& series, bool w_is_first) {
  for (Eigen::Matrix3d& R : series.rotations) {
    const Eigen::Quaterniond q(R);
    R = (w_is_first ? Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w())   // read as x y z w, is w x y z
                    : Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()))  // read as w x y z, is x y z w
            .toRotationMatrix();
  }
}

struct Candidate {
  std::string code, text;
  PoseSeries reference, estimate;
  bool of_reference = false;
};

std::vector<Candidate> conventions(const PoseSeries& reference, const PoseSeries& estimate,
                                   const PoseFrame& frame) {
  std::vector<Candidate> out;
  for (const Axes axes : {Axes::opengl, Axes::ned, Axes::flu}) {
    const std::string name(to_string(axes));
    Candidate of_estimate{"axes", "the estimate seems to be in the axes " + name + ": try --axes " + name,
                          reference, estimate};
    Candidate of_reference{"axes",
                           "the reference seems to be in the axes " + name + ": try --ref-axes " + name,
                           reference, estimate, true};
    to_camera(of_estimate.estimate, {axes, {}});
    to_camera(of_reference.reference, {axes, {}});
    if (frame.is_default()) out.push_back(std::move(of_estimate));
    out.push_back(std::move(of_reference));
  }
  for (const bool w_first : {true, false}) {
    const std::string text = fmt::format(
        "'s quaternions seem to have w {}: check the order of its columns; a header with a name each decides "
        "it (--format table), or --format",
        w_first ? "first" : "last");
    Candidate of_estimate{"columns", "the estimate" + text, reference, estimate};
    Candidate of_reference{"columns", "the reference" + text, reference, estimate, true};
    reorder_quaternions(of_estimate.estimate, w_first);
    reorder_quaternions(of_reference.reference, w_first);
    if (frame.is_default()) out.push_back(std::move(of_estimate));
    out.push_back(std::move(of_reference));
  }
  return out;
}

std::optional<TrajectoryWarning> convention(const PoseSeries& reference, const PoseSeries& estimate,
                                            const AlignmentChoice& choice, const PoseFrame& frame,
                                            const Agreement& now) {
  constexpr double turned_deg = 30, agrees_deg = 20, quarter = 0.25, tenth = 0.1;
  std::optional<TrajectoryWarning> best;
  double least = agrees_deg;
  for (Candidate& c : conventions(reference, estimate, frame)) {
    const auto then = aligned_agreement(c.reference, std::move(c.estimate), choice);
    // Where both sides would do, it is the estimate.
    constexpr double clearly = 0.5;
    if (!then || then->angle_deg >= (c.of_reference ? clearly : 1) * least) continue;
    const bool rotations = now.angle_deg > turned_deg && then->angle_deg < quarter * now.angle_deg &&
                           then->squares <= 1.01 * now.squares + 1e-9;
    const bool positions = c.code == "axes" && then->squares < tenth * now.squares;
    if (!rotations && !positions) continue;
    least = then->angle_deg;
    best = {
        c.code,
        fmt::format("{} (mean rotation error {:.1f} deg, {:.1f} then; position RMSE {:.3g} m, {:.3g} then)",
                    c.text, now.angle_deg, then->angle_deg,
                    std::sqrt(now.squares / static_cast<double>(reference.size())),
                    std::sqrt(then->squares / static_cast<double>(reference.size())))};
  }
  return best;
}

}  // namespace

std::optional<TrajectoryWarning> warning_of_clock(const PoseSeries& reference, const PoseSeries& estimate,
                                                  double offset_s, const AlignmentChoice& choice) {
  if (reference.stamps_s.empty() || estimate.stamps_s.empty() || reference.size() < fewest ||
      estimate.size() < fewest)
    return std::nullopt;
  AlignmentChoice all = choice;
  all.n_to_align = 0;
  const double step = std::max(median_step(reference.stamps_s), median_step(estimate.stamps_s));
  const PoseSeries some = thinned(estimate);
  const auto squares = [&](double shift_s) {
    return shifted_squares(reference, some, offset_s + shift_s, all);
  };
  const auto before = squares(-step), now = squares(0), after = squares(step);
  if (!before || !now || !after) return std::nullopt;
  const double bend = *before - 2 * *now + *after;
  if (!(bend > 0)) return std::nullopt;
  const auto explains = [&](std::optional<double> then) { return then && *then <= (1 - most) * *now; };
  if (!explains(squares(std::clamp(0.5 * step * (*before - *after) / bend, -step, step))))
    return std::nullopt;
  try {  // a shift along a straight path may be drift: what the motions alone say decides
    const OffsetEstimate found = estimate_offset(reference, estimate, offset_s, "");
    const bool is_zero = found.low_s <= offset_s && offset_s <= found.high_s;
    const double shift_s = found.offset_s - offset_s;
    const auto then = squares(shift_s);
    if (is_zero || !explains(then)) return std::nullopt;
    return TrajectoryWarning{
        "lag",
        fmt::format("the estimate's clock is {} by {:.3g} s, which explains {:.0f} % of the squared "
                    "errors; try --offset {:.4f}, or --estimate-offset",
                    shift_s < 0 ? "late" : "early", std::abs(shift_s), percent(*now, *then), found.offset_s)};
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<Eigen::Vector3d> estimate_lever_arm(const PoseSeries& reference, const PoseSeries& estimate) {
  SEXTANT_CHECK(reference.size() == estimate.size());
  constexpr double turn_rad = 0.2, least_turn_rad = 0.02, least_information = 0.03;
  const size_t n = estimate.size();
  if (n < fewest) return std::nullopt;
  const auto turn_rms = [&](size_t k) {
    double sum = 0;
    for (size_t i = 0; i + k < n; ++i) {
      const double angle = rotation_angle_rad(Eigen::Quaterniond(relative_pose(estimate, i, i + k).rotation));
      sum += angle * angle;
    }
    return std::sqrt(sum / static_cast<double>(n - k));
  };
  size_t k = 1;
  while (2 * k <= n / 4 && turn_rms(k) < turn_rad) k *= 2;
  if (turn_rms(k) < least_turn_rad) return std::nullopt;

  // Normal equations of (l, s); s is eliminated.
  Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  for (size_t i = 0; i + k < n; ++i) {
    const RelativePose e = relative_pose(estimate, i, i + k), r = relative_pose(reference, i, i + k);
    Eigen::Matrix<double, 3, 4> A;
    A << e.rotation - Eigen::Matrix3d::Identity(), e.translation_m;
    N += A.transpose() * A;
    b += A.transpose() * r.translation_m;
  }
  Eigen::Matrix3d M = N.topLeftCorner<3, 3>();
  Eigen::Vector3d c = b.head<3>();
  if (N(3, 3) > 0) {
    M -= N.topRightCorner<3, 1>() * N.topRightCorner<3, 1>().transpose() / N(3, 3);
    c -= N.topRightCorner<3, 1>() * (b[3] / N(3, 3));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(M);
  const double largest = solver.eigenvalues()[2];
  if (!(largest > 0)) return std::nullopt;
  Eigen::Vector3d l = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    if (solver.eigenvalues()[i] <= least_information * largest) continue;
    const Eigen::Vector3d direction = solver.eigenvectors().col(i);
    l += direction * (direction.dot(c) / solver.eigenvalues()[i]);
  }
  if (!l.allFinite()) return std::nullopt;
  return l;
}

std::vector<TrajectoryWarning> warnings_of_explanations(const PoseSeries& all_reference,
                                                        const PoseSeries& all_estimate,
                                                        const AlignmentChoice& choice,
                                                        const PoseFrame& frame) {
  if (all_estimate.size() < fewest) return {};
  const PoseSeries reference = thinned(all_reference), estimate = thinned(all_estimate);
  AlignmentChoice all = choice;
  all.n_to_align = 0;
  const auto now = aligned_agreement(reference, estimate, all);
  if (!now) return {};
  // In other axes nothing else can be judged.
  if (auto found = convention(reference, estimate, all, frame, *now)) return {*found};
  if (!(now->squares > 0)) return {};
  std::vector<TrajectoryWarning> out;
  if (auto found = yaw(reference, estimate, all)) out.push_back(*found);
  if (auto found = lever_arm(reference, estimate, all, frame, *now)) out.push_back(*found);
  return out;
}

}  // namespace sextant
