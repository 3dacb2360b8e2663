#pragma once

// The "noise" of a sweep's run.json: per source and level that adds any, what was asked for and what the
// cases' points really got, over seeds. It is made of the sums that each case leaves (cases.jsonl), so that
// nothing is drawn again for cases done earlier or in other shards.

#include <cstdint>
#include <map>

#include "sextant/base/json.h"

namespace sextant {

/// `plan` is Plan::json(); `sums` those of the cases at hand, by number: NoiseVerification::sums(), null
/// without noise. Estimators that are given the same points have the same draws, which count once. Throws
/// Error where a case of a noisy level has no sums.
Json achieved_noise(const Json& plan, const std::map<uint64_t, Json>& sums);

}  // namespace sextant
