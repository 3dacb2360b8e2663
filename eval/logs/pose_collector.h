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

/// Counts of repairs, with the first line of each.
class RepairLog {
 public:
  void note(const std::string& what, int64_t line);
  /// Returns "PATH:LINE: WHAT (N times)", in order of WHAT.
  std::vector<std::string> warnings(const std::string& path) const;

 private:
  struct Seen {
    int64_t line = 0;
    size_t n = 0;
  };
  std::map<std::string, Seen> seen_;
};

/// Throws Error on a position that is not finite or beyond 1e7 m; "PATH:NUMBER" (of a line or a message)
/// begins the message.
void check_position(const Eigen::Vector3d& position_m, const std::string& path, int64_t number);
/// Returns the rotation of the normalised quaternion; throws Error if the norm is wrong.
Eigen::Matrix3d checked_rotation(const Eigen::Quaterniond& q, const std::string& path, int64_t number,
                                 RepairLog& log);

/// Returns the position (3 values) of a record from `first` on.
Eigen::Vector3d position_at(const NumberFile& file, size_t first);
/// Returns the rotation of four values from `first` on; `w_first`: w x y z, otherwise x y z w.
Eigen::Matrix3d quaternion_at(const NumberFile& file, size_t first, bool w_first, RepairLog& log);
/// Adds the pose of a 3x4 matrix, stored row by row from `first` on.
void add_matrix(PoseSeries& series, const NumberFile& file, size_t first, RepairLog& log);
/// Checks R R' = I within limits; "PATH:LINE" begins the message.
void check_rotation(const Eigen::Matrix3d& rotation, const std::string& path, int64_t line, RepairLog& log);

/// Throws Error "PATH:LINE: ..." if the stamps, or the frame numbers, of a text file are not ascending.
void check_order(const PoseSeries& series, const std::string& path);

/// Sorts recordings by stamp, or by frame, and removes repeated ones; `truth` (may be null) is treated
/// likewise.
void sort_and_unite(PoseSeries& series, PoseSeries* truth, RepairLog& log);

/// Notes that the last line of the file was left out, if so.
void note_cut(const NumberFile& file, RepairLog& log);

// ---- Covariances of recorded poses: from the numbers of a file to the covariance in PoseSeries, of the
// error (position, rotation) in the axes of the world. number_file.h defines the meaning of the numbers.
//
// Numbers after a TUM line: 12 (upper triangles of rotation and position, openvins), 21 (upper triangle of
// the 6x6 matrix row by row) or 36 (the matrix row by row).

/// Returns true if a TUM line may have this many numbers after its eight.
bool is_covariance_size(size_t n);

/// Adds the covariance of the pose that was added last, from 12, 21 or 36 numbers. `convention`: by default
/// openvins for 12 numbers, otherwise ros. Throws Error "PATH:NUMBER: ..." if the matrix is not symmetric or
/// has a negative eigenvalue. A matrix of zeros is "unknown" (ROS).
void add_covariance(PoseSeries& series, std::span<const double> numbers,
                    std::optional<CovarianceConvention> convention, const std::string& path, int64_t number);

/// Called after the last pose: removes covariances that are all unknown, or of which one is singular (with a
/// note). Throws Error if some are unknown and others are not.
void finish_covariances(PoseSeries& series, const std::string& path, RepairLog& log);

}  // namespace sextant
