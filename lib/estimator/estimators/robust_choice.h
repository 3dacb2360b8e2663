#pragma once

// The option `robust` of every estimator: the kernel of its residuals.

#include "sextant/base/names.h"

namespace sextant {

enum class Robust { huber, geman_mcclure_gnc, none };
constexpr Names<3> names_of(Robust) { return {"huber", "geman_mcclure_gnc", "none"}; }

}  // namespace sextant
