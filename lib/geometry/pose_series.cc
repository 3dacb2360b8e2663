#include "sextant/geometry/pose_series.h"

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

RelativePose relative_pose(const PoseSeries& series, size_t i, size_t j) {
  const auto R_i_world = series.rotations[i].transpose();
  return {R_i_world * series.rotations[j], R_i_world * (series.positions_m[j] - series.positions_m[i])};
}

}  // namespace sextant
