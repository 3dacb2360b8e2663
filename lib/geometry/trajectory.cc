#include "sextant/geometry/trajectory.h"

#include <algorithm>

#include "sextant/base/error.h"

namespace sextant {
namespace {

template <typename T>
void keep_in(std::vector<T>& values, std::span<const int> indices) {
  if (values.empty()) return;
  std::vector<T> kept;
  kept.reserve(indices.size());
  for (const int i : indices) kept.push_back(values[static_cast<size_t>(i)]);
  values = std::move(kept);
}

}  // namespace

void PoseSeries::reserve(size_t n) {
  rotations.reserve(n);
  positions_m.reserve(n);
}

void PoseSeries::add(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position_m) {
  rotations.push_back(rotation);
  positions_m.push_back(position_m);
}

void PoseSeries::transform_covariance(size_t i, const Eigen::Matrix3d& R, double s,
                                      const Eigen::Vector3d& lever_world_m) {
  if (covariances.empty()) return;
  PoseCovariance J = PoseCovariance::Zero();
  J.topLeftCorner<3, 3>() = s * R;
  J.bottomRightCorner<3, 3>() = R;
  J.topRightCorner<3, 3>() = -skew(lever_world_m) * R;
  covariances[i] = J * covariances[i] * J.transpose();
}

void PoseSeries::keep(std::span<const int> indices) {
  bool all = indices.size() == size();
  for (size_t i = 0; all && i < indices.size(); ++i) all = indices[i] == static_cast<int>(i);
  if (all) return;
  keep_in(rotations, indices);
  keep_in(positions_m, indices);
  keep_in(stamps_s, indices);
  keep_in(frames, indices);
  keep_in(covariances, indices);
  keep_in(lines, indices);
}

SE3 PoseSeries::pose(size_t i) const { return {Eigen::Quaterniond(rotations[i]), positions_m[i]}; }

std::vector<double> path_lengths_m(const PoseSeries& series) {
  std::vector<double> lengths(series.size(), 0.0);
  for (size_t i = 1; i < series.size(); ++i)
    lengths[i] = lengths[i - 1] + (series.positions_m[i] - series.positions_m[i - 1]).norm();
  return lengths;
}

RelativePose relative_pose(const PoseSeries& series, size_t i, size_t j) {
  const auto R_i_world = series.rotations[i].transpose();
  return {R_i_world * series.rotations[j], R_i_world * (series.positions_m[j] - series.positions_m[i])};
}

InterpolatedPoses interpolate_poses(const PoseSeries& series, std::span<const double> times_s,
                                    double max_gap_s) {
  const std::vector<double>& stamps = series.stamps_s;
  SEXTANT_CHECK(!stamps.empty() && stamps.size() == series.size());
  InterpolatedPoses out;
  const bool has_rotations = series.has_rotations();
  const auto add = [&](size_t asked, size_t row, const Eigen::Vector3d& p) {
    out.poses.positions_m.push_back(p);
    out.poses.stamps_s.push_back(times_s[asked]);
    out.rows.push_back(static_cast<int>(row));
    out.asked.push_back(static_cast<int>(asked));
  };
  size_t j = 0;  // index of the first stamp at or after t
  for (size_t k = 0; k < times_s.size(); ++k) {
    const double t = times_s[k];
    while (j < stamps.size() && stamps[j] < t) ++j;
    if (j < stamps.size() && stamps[j] == t) {
      add(k, j, series.positions_m[j]);
      if (has_rotations) out.poses.rotations.push_back(series.rotations[j]);
      continue;
    }
    if (j == 0 || j == stamps.size()) {
      ++out.n_outside;
      continue;
    }
    const size_t i = j - 1;
    const double gap = stamps[j] - stamps[i];
    if (gap > max_gap_s) {
      ++out.n_in_longer_gaps;
      continue;
    }
    out.largest_gap_s = std::max(out.largest_gap_s, gap);
    const double w = (t - stamps[i]) / gap;
    add(k, w <= 0.5 ? i : j, (1 - w) * series.positions_m[i] + w * series.positions_m[j]);
    if (!has_rotations) continue;
    const Eigen::Quaterniond a(series.rotations[i]), b(series.rotations[j]);
    out.poses.rotations.push_back(a.normalized().slerp(w, b.normalized()).normalized().toRotationMatrix());
  }
  return out;
}

}  // namespace sextant
