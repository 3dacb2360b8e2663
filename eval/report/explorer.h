#pragma once

// Paths and curves along them that a reader of report.html walks through: pan, zoom, turn, one cursor in the
// path and in all curves, series switched on and off. The page has the script (html/page/explorer.js); a
// reader without JavaScript has the figures of the same section.

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace sextant {

/// Poses of all paths of one page, at most about: makers thin longer ones and say so in Explorer::note.
inline constexpr size_t explored_poses = 60'000;

/// One path with what is known along it. Lists are as long as `time`.
struct ExploredPath {
  std::string label;          ///< paths of one label are switched on and off together
  bool is_reference = false;  ///< drawn grey where it has a colour of its own, else dashed
  int colour = 0;             ///< 0: grey; k: the k-th line colour
  std::vector<double> time;   ///< ascending
  std::vector<int> frame;
  std::vector<Eigen::Vector3d> position_m;  ///< may be empty; NaN: not known
  std::vector<bool> begins;                 ///< a line begins here
  /// A list for each of Explorer::curves, NaN where not known; empty: not known at all.
  std::vector<std::vector<double>> values;
};

struct Explorer {
  std::string name;        ///< anchor of the page
  std::string time_title;  ///< "time [s]"
  /// Indices of the axes to the right, up and towards the reader, whose direction may be the negative one.
  std::array<int, 3> axes = {0, 2, 1};
  std::vector<std::string>
      curves;          ///< titles with units; the first also colours paths, behind it the page shows x, y, z
  std::string note{};  ///< below
  std::vector<ExploredPath> paths;  ///< drawn in this order
};

}  // namespace sextant
