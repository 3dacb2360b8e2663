#include "sextant/eval/evaluation/trajectory_agreement.h"

#include <Eigen/Eigenvalues>

#include "sextant/base/error.h"

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

}  // namespace sextant
