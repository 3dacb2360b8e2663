#pragma once

// Claims of the paper by name, for tests.

#include <algorithm>
#include <string_view>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/eval/report/claims/claim.h"

namespace sextant {

inline std::vector<ClaimResult> check_claim(std::string_view name, const Evidence& evidence) {
  const auto claim = std::ranges::find(claims(), name, &Claim::name);
  SEXTANT_CHECK(claim != claims().end());
  return claim->check(evidence);
}

}  // namespace sextant
