#pragma once

// Which frames of a sequence a source covers: all that are there, without a gap, or @first-last.

#include <set>

#include "sextant/datasets/dataset.h"

namespace sextant {

/// Sets info.first_frame and info.last_frame. Throws Error when `available` is empty, when the asked range
/// exceeds it, or when a frame in between is missing; `where` is the folder or scenario in messages.
void choose_frames(const SourceSpec& source, const std::set<int>& available, const std::string& where,
                   SequenceInfo& info);

/// Throws Error unless `frame` lies in the range.
void check_frame(const SequenceInfo& info, int frame, const std::string& where);

}  // namespace sextant
