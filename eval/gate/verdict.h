#pragma once

// The words of the gate. Worst first: what a whole comparison is follows from the worst of its parts, and is
// `improved` only where nothing is worse and something better.

#include <string_view>

namespace sextant {

enum class GateVerdict { invalid, regressed, inconclusive, improved, ok };

/// "invalid", ...
std::string_view to_string(GateVerdict verdict);
/// invalid 2, regressed 1, inconclusive 3, improved and ok 0.
int exit_code(GateVerdict verdict);
/// The worse of two.
GateVerdict worse(GateVerdict a, GateVerdict b);

}  // namespace sextant
