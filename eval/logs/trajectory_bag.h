#pragma once

// Poses of a topic in a ROS 1 bag, format 2.0 (wiki.ros.org/Bags/Format/2.0), chunks uncompressed, bz2 or
// lz4. The records are read one after the other, so an index is not needed; a bag that ends within a record
// is an Error. Memory: one chunk (256 MB at most) and 104 bytes a pose.

#include <string>

#include "sextant/eval/logs/trajectory_bytes.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {

bool is_bag(std::string_view first_bytes);

/// `topic` may be empty where only one has poses. Throws Error.
TrajectoryFile read_bag(ByteSource& bytes, const std::string& topic);

}  // namespace sextant
