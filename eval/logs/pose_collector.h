#pragma once

// Builds a PoseSeries from values of a file, judging every pose by the limits of trajectory_files.h.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/logs/number_file.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Poses of one file at most: 2 GB in memory.
inline constexpr size_t most_poses = 20'000'000;

/// Counts of what had to be repaired, with the first line of each.
class RepairLog {
 public:
  void note(const std::string& what, int64_t line);
  /// "PATH:LINE: WHAT (N times)", in order of WHAT.
  std::vector<std::string> warnings(const std::string& path) const;

 private:
  struct Seen {
    int64_t line = 0;
    size_t n = 0;
  };
  std::map<std::string, Seen> seen_;
};

/// Throws Error on what is not finite or beyond 1e7 m; "PATH:NUMBER" begins the message, a line or a message.
void check_position(const Eigen::Vector3d& position_m, const std::string& path, int64_t number);
/// Normalised; throws Error where the norm is off.
Eigen::Matrix3d checked_rotation(const Eigen::Quaterniond& q, const std::string& path, int64_t number,
                                 RepairLog& log);

/// Position (3 values) of a record from `first` on.
Eigen::Vector3d position_at(const NumberFile& file, size_t first);
/// Four values; `w_first`: w x y z, else x y z w.
Eigen::Matrix3d quaternion_at(const NumberFile& file, size_t first, bool w_first, RepairLog& log);
/// Adds the pose of a 3x4 matrix row by row at `first`.
void add_matrix(PoseSeries& series, const NumberFile& file, size_t first, RepairLog& log);
/// Checks R R' = I within limits; `where` begins the message.
void check_rotation(const Eigen::Matrix3d& rotation, const std::string& path, int64_t line, RepairLog& log);

/// Throws Error "PATH:LINE: ..." where the stamps, or the frame numbers, of a text file do not rise.
void check_order(const PoseSeries& series, const std::string& path);

/// Of recordings: sorts by stamp, or by frame, and drops what comes twice; `truth` (may be null) goes along.
void sort_and_unite(PoseSeries& series, PoseSeries* truth, RepairLog& log);

/// Says that the last line of the file was left out, where it was.
void note_cut(const NumberFile& file, RepairLog& log);

}  // namespace sextant
