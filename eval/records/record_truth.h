#pragma once

// What decides whether and where a record counts.

#include "sextant/eval/records/record.h"

namespace sextant {

/// Truth in both frames, and worth estimating: an object that is static by truth is not.
bool has_truth(const Record& record);

/// Where a body stands in tables: 0 for ego, else its id.
int body_order(Interned body);

}  // namespace sextant
