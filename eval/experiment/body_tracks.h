#pragma once

// The paths of a run's camera and objects (records/tracks.h).

#include "sextant/datasets/dataset.h"
#include "sextant/eval/experiment/case_runner.h"
#include "sextant/eval/records/tracks.h"

namespace sextant {

/// The camera first, then the objects of which a motion was estimated and a truth is known, by id.
std::vector<BodyTrack> body_tracks(const CaseMotions& motions, const SequenceTruth& truth,
                                   const SequenceInfo& info);

}  // namespace sextant
