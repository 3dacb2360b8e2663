#include "sextant/datasets/frame_range.h"

namespace sextant {

void choose_frames(const SourceSpec& source, const std::set<int>& available, const std::string& where,
                   SequenceInfo& info) {
  if (available.empty()) fail("{}: it has no frames", where);
  info.first_frame = source.first.value_or(*available.begin());
  info.last_frame = source.last.value_or(*available.rbegin());
  if (info.first_frame < *available.begin() || info.last_frame > *available.rbegin()) {
    fail("{}: frames {}-{} asked for, it has frames {}-{}", where, info.first_frame, info.last_frame,
         *available.begin(), *available.rbegin());
  }
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    if (available.contains(frame)) continue;
    fail("{}: frame {} is missing between {} and {}; add it, or choose other frames with @first-last", where,
         frame, info.first_frame, info.last_frame);
  }
}

void check_frame(const SequenceInfo& info, int frame, const std::string& where) {
  if (frame >= info.first_frame && frame <= info.last_frame) return;
  fail("{}: no frame {}: it has frames {}-{}", where, frame, info.first_frame, info.last_frame);
}

}  // namespace sextant
