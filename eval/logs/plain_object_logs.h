#pragma once

// The formats `motions` and `poses` of object_logs.h: one file per object.

#include <vector>

#include "sextant/eval/logs/object_log_files.h"

namespace sextant {

/// Returns one log with all objects of the folder. Throws Error on a folder without such files.
std::vector<ObjectLog> read_plain(const LogFolder& folder);

}  // namespace sextant
