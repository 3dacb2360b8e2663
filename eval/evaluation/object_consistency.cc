#include "sextant/eval/evaluation/object_consistency.h"

#include <functional>
#include <optional>

#include "sextant/eval/report/record_reading.h"

namespace sextant {
namespace {

struct Pair {
  SE3 estimate, truth;
};

/// Adds the NEES of every object. `pair_of(key)` returns the values that the covariance of `key` belongs to;
/// empty without truth.
void add(const LogCovariances& covariances, const std::string& system, uint64_t run,
         const std::function<std::optional<Pair>(ObjectFrame)>& pair_of,
         std::vector<ObjectConsistency>& out) {
  for (const auto& [id, path] : covariances.paths) {
    PoseSeries estimate, reference;
    for (auto it = covariances.entries.lower_bound({id, 0});
         it != covariances.entries.end() && it->first.first == id; ++it) {
      const auto pair = pair_of(it->first);
      if (!pair) continue;
      estimate.add(pair->estimate.rotation().toRotationMatrix(), pair->estimate.translation());
      estimate.covariances.push_back(it->second.P);
      estimate.lines.push_back(it->second.line);
      reference.add(pair->truth.rotation().toRotationMatrix(), pair->truth.translation());
    }
    if (const auto nees = trajectory_consistency(estimate, reference, path))
      out.push_back({system, run, id, *nees});
  }
}

}  // namespace

std::vector<ObjectConsistency> object_consistency(const ObjectLog& log, uint64_t run) {
  std::vector<ObjectConsistency> out;
  add(
      log.pose_covariances, log.estimator, run,
      [&](ObjectFrame key) -> std::optional<Pair> {
        const auto own = log.poses.find(key), truth = log.true_poses.find(key);
        if (own == log.poses.end() || truth == log.true_poses.end()) return std::nullopt;
        return Pair{own->second, truth->second};
      },
      out);
  add(
      log.motion_covariances, log.estimator, run,
      [&](ObjectFrame key) -> std::optional<Pair> {
        const auto motion = log.motions.find(key);
        if (motion == log.motions.end() || !motion->second.truth) return std::nullopt;
        return Pair{motion->second.estimate, *motion->second.truth};
      },
      out);
  return out;
}

Table object_consistency_table(const std::vector<ObjectConsistency>& found) {
  Table table{
      "Consistency of the covariances of objects",
      "Mean NEES, expected 6. The interval is that of independent errors; those of neighbouring frames depend on "
      "each other, which makes it wider.",
      folded_columns({"estimator"})};
  table.add_columns(
      {Column::count("run"), Column::text("object"), Column::count("n"), Column::number("nees", "mean", 3)});
  for (Column& column : range_columns("nees_low", "nees_high", 3, "95 % if consistent"))
    table.columns.push_back(std::move(column));
  table.add_columns(
      {Column::number("position", "position (3)", 3), Column::number("rotation", "rotation (3)", 3)});
  for (const ObjectConsistency& c : found) {
    table.add_row({c.system, c.run + 1, std::to_string(c.object), c.nees.n, c.nees.nees, c.nees.interval.low,
                   c.nees.interval.high, c.nees.position_nees, c.nees.rotation_nees});
  }
  return table;
}

}  // namespace sextant
