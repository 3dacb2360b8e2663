#pragma once

// Interactive paths, and curves along them, for report.html: pan, zoom, rotate, one cursor in the path and
// all curves, series switched on and off. The script is html/page/explorer.js; a reader without JavaScript
// sees the figures of the same section.

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace sextant {

/// Approximate largest number of poses of all paths on one page. Callers thin longer paths, and state it in
/// Explorer::note.
inline constexpr size_t explored_poses = 60'000;

/// One path with the quantities along it. Lists are as long as `time`.
struct ExploredPath {
  std::string label;          ///< paths with the same label are switched on and off together
  bool is_reference = false;  ///< drawn grey if `colour` is 0, otherwise dashed
  int colour = 0;             ///< 0: grey; k: the k-th line colour
  std::vector<double> time;   ///< ascending
  std::vector<int> frame;
  std::vector<Eigen::Vector3d> position_m;  ///< may be empty; NaN: unknown
  std::vector<bool> begins;                 ///< true if a line begins at this pose
  /// One list for each of Explorer::curves, with NaN for unknown values; an empty list if none is known.
  std::vector<std::vector<double>> values;
};

struct Explorer {
  std::string name;        ///< anchor of the page
  std::string time_title;  ///< "time [s]"
  /// Indices of the axes to the right, upwards and towards the reader; the last one may be the negative axis.
  std::array<int, 3> axes = {0, 2, 1};
  std::vector<std::string>
      curves;          ///< titles with units; the first one also colours the paths; the page appends x, y, z
  std::string note{};  ///< shown below the paths
  std::vector<ExploredPath> paths;  ///< drawn in this order
};

}  // namespace sextant
