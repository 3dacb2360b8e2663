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
int exit_code(GateVerdict verdict);
/// The worse of two.
GateVerdict worse(GateVerdict a, GateVerdict b);

}  // namespace sextant
