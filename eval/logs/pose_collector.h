#pragma once

// Builds a PoseSeries from the values of a file, and checks every pose against the limits of
// trajectory_files.h.

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/logs/number_file.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Largest number of poses that are read from a file; 2 GB in memory.
inline constexpr size_t most_poses_of_file = 20'000'000;

/// Counts of repairs, with the first line of each.
class RepairLog {
 public:
  void note(const std::string& what, int64_t line);
  /// Adds the repairs in `other`, made before or beside these.
  void add(const RepairLog& other);
  /// Returns "PATH:LINE: WHAT (N poses)", or "PATH: WHAT" for repairs without a line, in order of WHAT.
  std::vector<std::string> warnings(const std::string& path) const;

 private:
  struct Seen {
    int64_t line = 0;
    size_t n = 0;
  };
  std::map<std::string, Seen> seen_;
};

/// Throws Error on a position that is not finite or has a coordinate beyond 1e7 m; "PATH:NUMBER" (of a line
/// or a message) begins the text.
void check_position(const Eigen::Vector3d& position_m, const std::string& path, int64_t number);
/// Returns the rotation of the normalised quaternion. Throws Error if the norm differs from 1 by more than
/// 0.02; notes a difference above 1e-3 in `log`.
Eigen::Matrix3d checked_rotation(const Eigen::Quaterniond& q, const std::string& path, int64_t number,
                                 RepairLog& log);

/// Returns the position in the three values from `first` on; throws Error like check_position().
Eigen::Vector3d position_at(const NumberFile& file, size_t first);
/// Returns the rotation of the quaternion x y z w in the four values from `first` on.
Eigen::Matrix3d quaternion_at(const NumberFile& file, size_t first, RepairLog& log);
/// Adds the pose of a 3x4 matrix, stored row by row from `first` on.
void add_matrix(PoseSeries& series, const NumberFile& file, size_t first, RepairLog& log);
/// Throws Error "PATH:LINE: ..." if an element of R R' - I exceeds 1e-2, or if R is a reflection; notes
/// elements above 1e-5 in `log`.
void check_rotation(const Eigen::Matrix3d& rotation, const std::string& path, int64_t line, RepairLog& log);

/// Throws Error "PATH:LINE: ..." if the stamps, or the frame numbers, of a text file are not ascending.
void check_order(const PoseSeries& series, const std::string& path);

/// Sorts the poses by time stamp or, without stamps, by frame number, and keeps the first of those with the
/// same one, with notes in `log`. `truth`, which may be null, is reordered in the same way.
void sort_and_unite(PoseSeries& series, PoseSeries* truth, RepairLog& log);

/// Adds a note to `log` if the last line of the file was left out.
void note_cut(const NumberFile& file, RepairLog& log);

// ---- Covariances of recorded poses: from the numbers of a file to the covariance in PoseSeries, of the
// error (position, rotation) in the axes of the world. number_file.h defines the meaning of the numbers.
//
// Numbers after a TUM line: 12 (upper triangles of rotation and position, openvins), 21 (upper triangle of
// the 6x6 matrix row by row) or 36 (the matrix row by row).

/// Returns true if a TUM line may have this many numbers after its eight.
bool is_covariance_size(size_t n);

/// Adds the covariance of the pose that was added last, from 12, 21 or 36 numbers. `convention`: by default
/// openvins for 12 numbers, otherwise ros. Throws Error "PATH:NUMBER: ..." if the matrix is not finite, not
/// symmetric, or has a negative eigenvalue. A matrix of zeros means "unknown" (ROS).
void add_covariance(PoseSeries& series, std::span<const double> numbers,
                    std::optional<CovarianceConvention> convention, const std::string& path, int64_t number);

/// Checks the covariances after the last pose. Removes all of them if all are unknown, or if one is singular
/// (with a note). Throws Error if some poses have no covariance, or if only some covariances are unknown.
void finish_covariances(PoseSeries& series, const std::string& path, RepairLog& log);

}  // namespace sextant
