#include "sextant/eval/evaluation/trajectory_agreement.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "sextant/base/error.h"

namespace sextant {
namespace {

/// An alignment to positions on a line does not determine the rotation about it: the rotations of the poses
/// do.
void close_roll(PoseSeries& estimate, const PoseSeries& reference) {
  constexpr double flat = 1e-3;
  if (!reference.has_rotations() || !estimate.has_rotations()) return;
  const auto u = umeyama(reference.positions_m, reference.positions_m, false);
  if (!u || u->flatness < flat) turn_about_path(estimate, reference);
}

}  // namespace

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

double rms_extent_m(const PoseSeries& series) {
  const Eigen::Vector3d mean = mean_position(series);
  double squares = 0;
  for (const Eigen::Vector3d& p : series.positions_m) squares += (p - mean).squaredNorm();
  return std::sqrt(squares / static_cast<double>(series.size()));
}

bool turns_world(Alignment a) { return a == Alignment::se3 || a == Alignment::sim3; }

Eigen::Vector3d mean_position(const PoseSeries& series) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : series.positions_m) mean += p / static_cast<double>(series.size());
  return mean;
}

Agreement agreement(const PoseSeries& reference, const PoseSeries& estimate) {
  Agreement out{.n = reference.size()};
  const bool rotations = reference.has_rotations() && estimate.has_rotations();
  for (size_t i = 0; i < reference.size(); ++i) {
    out.squares += (reference.positions_m[i] - estimate.positions_m[i]).squaredNorm();
    if (!rotations) continue;
    const Eigen::Matrix3d difference = reference.rotations[i].transpose() * estimate.rotations[i];
    out.angle_deg += rotation_angle_rad(Eigen::Quaterniond(difference)) * 180 / std::numbers::pi /
                     static_cast<double>(reference.size());
  }
  return out;
}

void turn_about_path(PoseSeries& estimate, const PoseSeries& reference) {
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

bool try_align(PoseSeries& estimate, const PoseSeries& reference, const AlignmentChoice& choice) {
  try {
    align(estimate, reference, choice.alignment, choice.n_to_align, choice.up);
  } catch (const Error&) {
    return false;
  }
  if (turns_world(choice.alignment)) close_roll(estimate, reference);
  return true;
}

std::optional<Agreement> aligned_agreement(const PoseSeries& all_reference, const PoseSeries& all_estimate,
                                           const AlignmentChoice& choice) {
  const PoseSeries reference = thinned(all_reference);
  PoseSeries estimate = thinned(all_estimate);
  if (!try_align(estimate, reference, choice)) return std::nullopt;
  return agreement(reference, estimate);
}

}  // namespace sextant
