#pragma once

// Adapter `synthetic`: rendered scenes that need no download (datasets/synthetic/). SOURCE is
// synthetic:<scenario>[@first-last]; depth, flow, masks and truth are exact.

#include <memory>

#include "sextant/datasets/dataset.h"

namespace sextant {

/// None so far: a scenario is complete by its name.
struct SyntheticOptions {
  template <typename V>
  void visit(V&) {}
};

/// Throws Error on an unknown scenario or option, a '#' in the source, or frames that it does not have.
std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source);

}  // namespace sextant
