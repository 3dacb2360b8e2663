#pragma once

// Poses of a topic in an MCAP file (mcap.dev/spec), chunks uncompressed, lz4 or zstd, checked by their CRC
// where they have one. The records are read one after the other, so an index is not needed; a file without
// its end of data is an Error. Memory: one chunk (256 MB at most, compressed and not) and 104 bytes a pose.

#include <string>

#include "sextant/eval/logs/trajectory_bytes.h"
#include "sextant/eval/logs/trajectory_files.h"

namespace sextant {

bool is_mcap(std::string_view first_bytes);

/// `topic` may be empty where only one has poses. Throws Error.
TrajectoryFile read_mcap(ByteSource& bytes, const std::string& topic);

}  // namespace sextant
