#pragma once

// Whether two sides may be compared at all: same data, definitions, configuration and machine, and the same
// cases on both. Nothing that differs is passed over; what is accepted by the policy is still said.

#include <string>
#include <vector>

#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/side.h"

namespace sextant {

/// One thing that differs.
struct Mismatch {
  std::string what;  ///< key of SamenessPolicy, "input", or "build" (always a note)
  std::string subject;
  std::string base;
  std::string fresh;  ///< in NEW
  bool invalidates = true;
};

/// From provenance alone; cases are compared where they are paired (accuracy.h, speed.h).
std::vector<Mismatch> compare_provenance(const Side& base, const Side& fresh, const Policy& policy);

/// Strictness::must in the policy.
Mismatch mismatch(Strictness rule, std::string what, std::string subject, std::string base, std::string fresh);

}  // namespace sextant
