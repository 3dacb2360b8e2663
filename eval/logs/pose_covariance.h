#pragma once

// Covariances of recorded poses: from the numbers of a file to the covariance of PoseSeries, which is of the
// error (position, rotation) in the axes of the world. covariance_convention.h says what the numbers mean.
//
// Numbers behind a TUM line: 12 (upper triangles of rotation and position, openvins), 21 (upper triangle of
// the 6x6 matrix row by row) or 36 (the matrix row by row).

#include <optional>
#include <span>
#include <string>

#include "sextant/eval/logs/covariance_convention.h"
#include "sextant/eval/logs/pose_collector.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

/// Whether a TUM line may have as many numbers behind its eight.
bool is_covariance_size(size_t n);

/// Adds the covariance of the pose that was added last, from 12, 21 or 36 numbers. `convention`: openvins for
/// 12, else ros, where none is given. Throws Error "PATH:NUMBER: ..." when the matrix is not symmetric or has
/// a negative eigenvalue. A matrix of zeros is "unknown" (ROS).
void add_covariance(PoseSeries& series, std::span<const double> numbers,
                    std::optional<CovarianceConvention> convention, const std::string& path, int64_t number);

/// After the last pose: covariances that are all unknown, or of which one is singular, are dropped; the
/// latter with a note. Throws Error where some are unknown and others are not.
void finish_covariances(PoseSeries& series, const std::string& path, RepairLog& log);

}  // namespace sextant
