#include "sextant/eval/evaluation/object_paths.h"

#include <algorithm>
#include <numbers>
#include <set>

#include "sextant/base/error.h"
#include "sextant/eval/report/record_reading.h"
#include "sextant/metrics/trajectory_alignment.h"
#include "sextant/metrics/trajectory_errors.h"

namespace sextant {
namespace {

using Poses = std::map<ObjectFrame, SE3>;

struct Paths {
  PoseSeries estimate, reference;
};

/// Poses of the object `id` at the frames that both sides have.
Paths common_paths(const Poses& estimate, const Poses& reference, int id) {
  Paths paths;
  for (auto it = estimate.lower_bound({id, 0}); it != estimate.end() && it->first.first == id; ++it) {
    const auto truth = reference.find(it->first);
    if (truth == reference.end()) continue;
    for (auto [series, pose] :
         {std::pair(&paths.estimate, &it->second), std::pair(&paths.reference, &truth->second)}) {
      series->add(pose->rotation().toRotationMatrix(), pose->translation());
      series->frames.push_back(it->first.second);
    }
  }
  return paths;
}

std::optional<PathError> relative(const Paths& paths, const std::vector<PosePair>& pairs) {
  if (pairs.empty()) return std::nullopt;
  const auto rmse = [&](PoseRelation relation) {
    return error_statistics(relative_errors(paths.estimate, paths.reference, pairs, relation)).rmse;
  };
  return PathError{pairs.size(), rmse(PoseRelation::trans_part), rmse(PoseRelation::angle_deg)};
}

std::optional<PathError> absolute(Paths paths) {
  constexpr size_t fewest = 3;
  if (paths.estimate.size() < fewest) return std::nullopt;
  try {
    align(paths.estimate, paths.reference, Alignment::se3);
  } catch (const Error&) {
    return std::nullopt;
  }
  const auto rmse = [&](PoseRelation relation) {
    return error_statistics(absolute_errors(paths.estimate, paths.reference, relation)).rmse;
  };
  return PathError{paths.estimate.size(), rmse(PoseRelation::trans_part), rmse(PoseRelation::angle_deg)};
}

std::optional<ObjectPathErrors::PerAxis> per_axis(const Paths& paths) {
  const size_t n = paths.estimate.size();
  if (n < 2) return std::nullopt;
  const SE3 first = paths.reference.pose(0).inverse() * paths.estimate.pose(0);
  ObjectPathErrors::PerAxis axes{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  const double weight = 1 / static_cast<double>(n - 1);
  for (size_t k = 1; k < n; ++k) {
    const Vector6d e = (paths.estimate.pose(k).inverse() * paths.reference.pose(k) * first).log();
    axes.mean_m += weight * e.head<3>().cwiseAbs();
    axes.mean_deg += weight * 180 / std::numbers::pi * e.tail<3>().cwiseAbs();
    axes.largest_m = std::max(axes.largest_m, e.head<3>().norm());
  }
  return axes;
}

/// Pairs of each pose and the next one, for RPE; with `successive` only pairs of successive frames.
std::vector<PosePair> steps_of(const PoseSeries& series, bool successive) {
  std::vector<PosePair> pairs;
  for (size_t i = 1; i < series.size(); ++i) {
    if (!successive || series.frames[i] == series.frames[i - 1] + 1)
      pairs.emplace_back(static_cast<int>(i - 1), static_cast<int>(i));
  }
  return pairs;
}

Cell cell(const std::optional<PathError>& error, double PathError::*number) {
  return error ? Cell((*error).*number) : Cell();
}

}  // namespace

std::vector<ObjectPathErrors> object_path_errors(const ObjectLog& log, uint64_t run) {
  std::vector<ObjectPathErrors> out;
  if (log.true_poses.empty()) return out;
  const Poses chained = chained_poses(log);
  std::set<int> ids;
  for (const Poses* poses : {&log.poses, &chained}) {
    for (const auto& [key, pose] : *poses) ids.insert(key.first);
  }
  for (const int id : ids) {
    const Paths logged = common_paths(log.poses, log.true_poses, id),
                by_motions = common_paths(chained, log.true_poses, id);
    ObjectPathErrors errors{log.estimator,
                            run,
                            id,
                            absolute(logged),
                            relative(logged, steps_of(logged.estimate, false)),
                            relative(by_motions, steps_of(by_motions.estimate, true)),
                            per_axis(logged)};
    if (errors.rpe || errors.chained_rpe) out.push_back(std::move(errors));
  }
  return out;
}

Table object_path_table(const std::vector<ObjectPathErrors>& errors) {
  Table table{
      "Object poses",
      "RMSE. APE after a rigid alignment of each object's path; RPE over steps of one pose; chained: RPE of the "
      "path chained from the logged motions.",
      folded_columns({"estimator"})};
  table.add_columns({Column::count("run"), Column::text("object"), Column::count("poses"),
                     Column::number("ape_m", "APE [m]", 4), Column::number("ape_deg", "APE [deg]", 4),
                     Column::number("rpe_m", "RPE [m]", 4), Column::number("rpe_deg", "RPE [deg]", 4),
                     Column::number("chained_rpe_m", "chained [m]", 4),
                     Column::number("chained_rpe_deg", "chained [deg]", 4)});
  for (const ObjectPathErrors& e : errors) {
    table.add_row({e.system, e.run + 1, std::to_string(e.object), e.ape ? Cell(e.ape->n) : Cell(),
                   cell(e.ape, &PathError::Et_m), cell(e.ape, &PathError::ER_deg),
                   cell(e.rpe, &PathError::Et_m), cell(e.rpe, &PathError::ER_deg),
                   cell(e.chained_rpe, &PathError::Et_m), cell(e.chained_rpe, &PathError::ER_deg)});
  }
  return table;
}

Table object_axis_table(const std::vector<ObjectPathErrors>& errors) {
  Table table{
      "Object poses, errors per axis",
      "As the Oxford Multimotion benchmark: log of the pose error since the first pose, means of absolute "
      "values, in the object's axes.",
      folded_columns({"estimator"})};
  table.add_columns({Column::count("run"), Column::text("object"), Column::number("x_m", "x [m]", 4),
                     Column::number("y_m", "y [m]", 4), Column::number("z_m", "z [m]", 4),
                     Column::number("rx_deg", "rx [deg]", 3), Column::number("ry_deg", "ry [deg]", 3),
                     Column::number("rz_deg", "rz [deg]", 3), Column::number("largest_m", "largest [m]", 4)});
  for (const ObjectPathErrors& e : errors) {
    if (!e.axes) continue;
    const auto& [m, deg, largest] = *e.axes;
    table.add_row({e.system, e.run + 1, std::to_string(e.object), m.x(), m.y(), m.z(), deg.x(), deg.y(),
                   deg.z(), largest});
  }
  return table;
}

}  // namespace sextant
