#include "sextant/geometry/pose_interpolation.h"

#include <algorithm>

#include "sextant/base/error.h"

namespace sextant {

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
  size_t j = 0;  // the first stamp not before the time
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
    out.poses.rotations.push_back(
        a.normalized().slerp(w, b.normalized()).normalized().toRotationMatrix());
  }
  return out;
}

}  // namespace sextant
