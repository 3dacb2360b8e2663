#pragma once

// Covariances of recorded poses: from the numbers of a file to the covariance in PoseSeries, of the error
// (position, rotation) in the axes of the world. covariance_convention.h defines the meaning of the numbers.
//
// Numbers after a TUM line: 12 (upper triangles of rotation and position, openvins), 21 (upper triangle of
// the 6x6 matrix row by row) or 36 (the matrix row by row).

#include <optional>
#include <span>
#include <string>

#include "sextant/eval/logs/covariance_convention.h"
#include "sextant/eval/logs/pose_collector.h"
#include "sextant/geometry/trajectory.h"

namespace sextant {

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
