#include "sextant/metrics/pose_pairs.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "sextant/base/error.h"

namespace sextant {
namespace {

constexpr double rad_per_deg = std::numbers::pi / 180;
constexpr size_t max_poses_of_all_angles = 100'000;

std::vector<PosePair> pairs_by_frames(size_t n, int delta, bool all) {
  std::vector<PosePair> pairs;
  for (size_t i = 0; i + static_cast<size_t>(delta) < n; i += all ? 1 : static_cast<size_t>(delta))
    pairs.emplace_back(static_cast<int>(i), static_cast<int>(i) + delta);
  return pairs;
}

/// Each i with the j > i whose value is nearest to values[i] + delta, if within `tolerance`. Ascending
/// values; of several as near the first.
std::vector<PosePair> nearest_pairs(const std::vector<double>& values, double delta, double tolerance) {
  std::vector<PosePair> pairs;
  const auto first = values.begin();
  for (auto i = first; i + 1 < values.end(); ++i) {
    const auto off = [&](double value) { return std::abs((value - *i) - delta); };
    auto best = std::partition_point(i + 1, values.end(), [&](double v) { return v - *i < delta; });
    if (best == values.end() || (best > i + 1 && off(best[-1]) <= off(*best))) --best;
    const double nearest = off(*best);
    best = std::partition_point(i + 1, best, [&](double v) { return off(v) > nearest; });
    if (nearest <= tolerance) pairs.emplace_back(i - first, best - first);
  }
  return pairs;
}

std::vector<double> path_lengths(const PoseSeries& series) {
  std::vector<double> lengths(series.size(), 0.0);
  for (size_t i = 1; i < series.size(); ++i)
    lengths[i] = lengths[i - 1] + (series.positions_m[i - 1] - series.positions_m[i]).norm();
  return lengths;
}

std::vector<PosePair> consecutive_by_path(const PoseSeries& series, double delta) {
  std::vector<PosePair> pairs;
  int last = -1;
  double path = 0;
  for (size_t i = 0; i < series.size(); ++i) {
    if (i > 0) path += (series.positions_m[i] - series.positions_m[i - 1]).norm();
    if (path < delta) continue;
    if (last >= 0) pairs.emplace_back(last, static_cast<int>(i));
    last = static_cast<int>(i);
    path = 0;
  }
  return pairs;
}

/// From 0: a pair ends whenever the sum of the steps since the last end reaches delta.
template <typename Step>
std::vector<PosePair> chained_pairs(size_t n, double delta, const Step& step) {
  std::vector<PosePair> pairs;
  double sum = 0;
  int begin = 0;
  for (size_t i = 1; i < n; ++i) {
    sum += step(i);
    if (sum < delta) continue;
    pairs.emplace_back(begin, static_cast<int>(i));
    begin = static_cast<int>(i);
    sum = 0;
  }
  return pairs;
}

std::vector<PosePair> consecutive_by_angle(const PoseSeries& series, double delta_rad) {
  return chained_pairs(series.size(), delta_rad, [&](size_t i) {
    return rotation_angle_rad(Eigen::Quaterniond(relative_pose(series, i - 1, i).rotation));
  });
}

std::vector<PosePair> all_by_angle(const PoseSeries& series, double delta_rad, double tolerance_rad) {
  if (series.size() > max_poses_of_all_angles) {
    fail(
        "all pairs by angle: {} poses are too many (limit {}); use consecutive pairs, or --t-start and --t-end",
        series.size(), max_poses_of_all_angles);
  }
  std::vector<Eigen::Quaterniond> q;
  q.reserve(series.size());
  for (const Eigen::Matrix3d& r : series.rotations) q.push_back(Eigen::Quaterniond(r).normalized());
  const double low = delta_rad - tolerance_rad;
  const double high = delta_rad + tolerance_rad;
  // |w| of a relative rotation falls as its angle grows: a cheap test first, the exact one near the bounds.
  const double w_low = std::cos(std::clamp(high / 2, 0.0, std::numbers::pi / 2)) - 1e-9;
  const double w_high = std::cos(std::clamp(low / 2, 0.0, std::numbers::pi / 2)) + 1e-9;
  std::vector<PosePair> pairs;
  for (size_t i = 0; i + 1 < q.size(); ++i) {
    for (size_t j = i + 1; j < q.size(); ++j) {
      const double w = std::abs(q[i].dot(q[j]));
      if (w < w_low || w > w_high) continue;
      const double angle = rotation_angle_rad(q[i].conjugate() * q[j]);
      if (low <= angle && angle <= high) pairs.emplace_back(static_cast<int>(i), static_cast<int>(j));
    }
  }
  return pairs;
}

std::vector<PosePair> pairs_by_time(const PoseSeries& series, const PairSelection& selection) {
  if (series.stamps_s.empty())
    fail("pairs in seconds need time stamps, which this format does not have; use frames");
  const std::vector<double>& t = series.stamps_s;
  if (selection.all_pairs)
    return nearest_pairs(t, selection.delta, selection.delta * selection.relative_tolerance);
  std::vector<PosePair> pairs;
  constexpr double rounding_s = 1e-6;  // stamps in microseconds: 10 steps of 0.1 s are 1 s
  for (size_t i = 1, begin = 0; i < t.size(); ++i) {
    if (t[i] - t[begin] < selection.delta - rounding_s) continue;
    pairs.emplace_back(static_cast<int>(begin), static_cast<int>(i));
    begin = i;
  }
  return pairs;
}

std::vector<PosePair> pairs_of(const PoseSeries& series, const PairSelection& s) {
  const double delta_rad = s.delta * (s.unit == DeltaUnit::degrees ? rad_per_deg : 1);
  switch (s.unit) {
    case DeltaUnit::frames:
      return pairs_by_frames(series.size(), static_cast<int>(s.delta), s.all_pairs);
    case DeltaUnit::metres:
      if (!s.all_pairs) return consecutive_by_path(series, s.delta);
      return nearest_pairs(path_lengths(series), s.delta, s.delta * s.relative_tolerance);
    case DeltaUnit::degrees:
    case DeltaUnit::radians:
      if (!s.all_pairs) return consecutive_by_angle(series, delta_rad);
      return all_by_angle(series, delta_rad, delta_rad * s.relative_tolerance);
    case DeltaUnit::seconds:
      return pairs_by_time(series, s);
  }
  SEXTANT_CHECK(false);
}

}  // namespace

PairSelection PairSelection::parse(const std::string& text) {
  constexpr const char* form = "expected a number and a unit: 1f (frames), 10m, 5deg, 0.5rad or 2s";
  PairSelection s;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), s.delta);
  const std::string_view unit(end, static_cast<size_t>(text.data() + text.size() - end));
  const std::optional<DeltaUnit> known = find_name<DeltaUnit>(unit);
  if (error != std::errc() || !known) fail("--rpe {}: {}", text, form);
  s.unit = *known;
  if (!(s.delta > 0) || !std::isfinite(s.delta)) fail("--rpe {}: must be above 0", text);
  if (s.unit == DeltaUnit::frames && (s.delta != std::trunc(s.delta) || s.delta > 1e9))
    fail("--rpe {}: a whole number of frames is needed", text);
  if ((s.unit == DeltaUnit::degrees && s.delta > 180) ||
      (s.unit == DeltaUnit::radians && s.delta > std::numbers::pi))
    fail("--rpe {}: an angle is at most 180 deg", text);
  return s;
}

std::string PairSelection::text() const { return fmt::format("{}{}", delta, to_string(unit)); }

std::vector<PosePair> select_pairs(const PoseSeries& series, const PairSelection& selection) {
  std::vector<PosePair> pairs = pairs_of(series, selection);
  if (pairs.empty()) {
    fail("no pair of poses lies {} apart among {} poses: use a smaller distance{}", selection.text(),
         series.size(), selection.all_pairs ? " or a larger --delta-tolerance" : "");
  }
  return pairs;
}

}  // namespace sextant
