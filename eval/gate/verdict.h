#pragma once

// The words of the gate. Worst first: what a whole comparison is follows from the worst of its parts, and is
// `improved` only where nothing is worse and something better.

#include "sextant/base/names.h"

namespace sextant {

enum class GateVerdict { invalid, regressed, inconclusive, improved, ok };

constexpr Names<5> names_of(GateVerdict) {
  return {"invalid", "regressed", "inconclusive", "improved", "ok"};
}
/// invalid 2, regressed 1, inconclusive 3, improved and ok 0.
constexpr int exit_code(GateVerdict verdict) {
  constexpr int codes[] = {2, 1, 3, 0, 0};
  return codes[static_cast<size_t>(verdict)];
}

}  // namespace sextant
