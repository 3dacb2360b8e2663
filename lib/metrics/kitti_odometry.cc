#include "sextant/metrics/kitti_odometry.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "sextant/base/error.h"

namespace sextant {
namespace {

constexpr size_t frames_between_stretches = 10;
constexpr std::array<double, 8> lengths_m = {100, 200, 300, 400, 500, 600, 700, 800};

struct Sum {
  double translation = 0;  // m/m
  double rotation = 0;     // rad/m
  int n = 0;
};

KittiOdometryError mean_of(const Sum& sum, double length_m) {
  KittiOdometryError e{length_m, sum.n, {}, {}};
  if (sum.n == 0) return e;
  e.translation_percent = 100 * sum.translation / sum.n;
  e.rotation_deg_per_m = 180 / std::numbers::pi * sum.rotation / sum.n;
  return e;
}

}  // namespace

KittiOdometryErrors kitti_odometry_errors(const PoseSeries& estimate, const PoseSeries& reference) {
  SEXTANT_CHECK(estimate.size() == reference.size() && !reference.empty());
  std::vector<double> path(reference.size(), 0.0);
  for (size_t i = 1; i < path.size(); ++i)
    path[i] = path[i - 1] + (reference.positions_m[i] - reference.positions_m[i - 1]).norm();

  std::array<Sum, lengths_m.size()> sums;
  for (size_t first = 0; first < path.size(); first += frames_between_stretches) {
    for (size_t k = 0; k < lengths_m.size(); ++k) {
      const auto last = std::upper_bound(path.begin() + static_cast<std::ptrdiff_t>(first), path.end(),
                                         path[first] + lengths_m[k]);
      if (last == path.end()) break;
      const auto j = static_cast<size_t>(last - path.begin());
      const RelativePose p = relative_pose(estimate, first, j), q = relative_pose(reference, first, j);
      const Eigen::Matrix3d rotation = p.rotation.transpose() * q.rotation;
      sums[k].translation +=
          (p.rotation.transpose() * (q.translation_m - p.translation_m)).norm() / lengths_m[k];
      sums[k].rotation += rotation_angle_rad(Eigen::Quaterniond(rotation)) / lengths_m[k];
      ++sums[k].n;
    }
  }
  KittiOdometryErrors errors;
  errors.path_m = path.back();
  Sum all;
  for (size_t k = 0; k < sums.size(); ++k) {
    errors.by_length.push_back(mean_of(sums[k], lengths_m[k]));
    all = {all.translation + sums[k].translation, all.rotation + sums[k].rotation, all.n + sums[k].n};
  }
  errors.all = mean_of(all, 0);
  return errors;
}

}  // namespace sextant
