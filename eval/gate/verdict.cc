#include "sextant/eval/gate/verdict.h"

#include <algorithm>
#include <array>

namespace sextant {

int exit_code(GateVerdict verdict) {
  constexpr std::array<int, 5> codes = {2, 1, 3, 0, 0};
  return codes.at(static_cast<size_t>(verdict));
}

GateVerdict worse(GateVerdict a, GateVerdict b) { return std::min(a, b); }

}  // namespace sextant
