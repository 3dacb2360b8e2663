#include <algorithm>

#include "sextant/eval/evaluation/trajectory_figures.h"

namespace sextant {
namespace {

std::vector<double> kept_coordinates(const std::vector<Eigen::Vector3d>& vectors, int axis,
                                     const std::vector<size_t>& kept) {
  std::vector<double> list;
  for (const size_t i : kept) {
    if (!vectors.empty()) list.push_back(vectors[i][axis]);
  }
  return list;
}

template <typename Value>
std::vector<Value> of_kept(const std::vector<Value>& all, const std::vector<size_t>& kept) {
  std::vector<Value> list;
  for (const size_t i : kept) {
    if (!all.empty()) list.push_back(all[i]);
  }
  return list;
}

ExploredPath explored(const TrajectoryCurve& curve, int colour, size_t most) {
  const std::vector<size_t> kept = thinned(curve, most);
  return {.label = curve.name,
          .is_reference = colour == 0,
          .colour = colour,
          .time = of_kept(curve.time, kept),
          .frame = of_kept(curve.frame, kept),
          .position_m = of_kept(curve.position_m, kept),
          .begins = of_kept(curve.begins, kept),
          .values = {of_kept(curve.error, kept), kept_coordinates(curve.angles_deg, 0, kept),
                     kept_coordinates(curve.angles_deg, 1, kept), kept_coordinates(curve.angles_deg, 2, kept),
                     of_kept(curve.speed, kept)}};
}

}  // namespace

Explorer ego_explorer(const EgoCurves& curves) {
  Explorer explorer{
      .name = "walk",
      .time_title = curves.time_title(),
      .axes = {curves.axes.right, curves.axes.up, curves.axes.out},
      .curves = {curves.error_title, "roll [deg]", "pitch [deg]", "yaw [deg]", curves.speed_title()}};
  size_t n_poses = curves.reference.size();
  for (const TrajectoryCurve& run : curves.runs) n_poses += run.size();
  const size_t most = n_poses <= explored_poses ? n_poses : explored_poses / (curves.runs.size() + 1);
  explorer.paths.push_back(explored(curves.reference, 0, most));
  for (const TrajectoryCurve& run : curves.runs)
    explorer.paths.push_back(explored(run, static_cast<int>(explorer.paths.size()), most));
  size_t n_shown = 0;
  for (const ExploredPath& path : explorer.paths) n_shown += path.time.size();
  if (n_shown < n_poses)
    explorer.note = fmt::format(
        "{} of {} poses are shown here, among them those of the largest errors; curves/ holds all.", n_shown,
        n_poses);
  return explorer;
}

}  // namespace sextant
