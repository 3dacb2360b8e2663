#pragma once

// Adapter `synthetic`: rendered scenes that need no download (datasets/synthetic/). SOURCE is
// synthetic:<scenario>[@first-last]; depth, flow, masks and truth are exact.

#include <memory>

#include "sextant/datasets/rendered_sequence.h"

namespace sextant {

using SyntheticOptions = RenderCacheOptions;

/// Throws Error on an unknown scenario or option, a '#' in the source, or frames that it does not have.
std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source);

}  // namespace sextant
