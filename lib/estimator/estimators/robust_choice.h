#pragma once

// The option `robust` of every estimator.

#include <string>

#include "sextant/base/options.h"

namespace sextant {

inline constexpr const char* robust_meaning = "huber, geman_mcclure_gnc or none";

inline void check_robust(const std::string& robust) {
  check_option(robust == "huber" || robust == "geman_mcclure_gnc" || robust == "none", "robust", robust,
               robust_meaning);
}

}  // namespace sextant
