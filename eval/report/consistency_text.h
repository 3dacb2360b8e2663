#pragma once

// How halves of the bodies agree (`sextant run --consistency`).

#include <string>
#include <vector>

#include "sextant/eval/records/record.h"

namespace sextant {

/// By body: means of values.split_nees, of its two kinds and of values.nees, a line each; empty where no record has
/// split_nees.
std::string consistency_text(const std::vector<Record>& records);

}  // namespace sextant
