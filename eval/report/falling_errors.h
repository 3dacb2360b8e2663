#pragma once

// Errors that fall from the lowest to the highest level of noise, with the reason as far as records show it. The
// mean over all estimated pairs may fall although the estimator does not become better: under more noise fewer
// pairs are estimated, and the difficult ones are missing first. The pairs estimated at both levels decide:
//
//   coverage   on these pairs the error does not fall
//   selection  it falls on these pairs as well: the estimate is made of other points, or the fall is chance

#include <optional>
#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"
#include "sextant/eval/report/table.h"

namespace sextant {

struct FallingError {
  std::string parameter, dataset, sequence, body, estimator;
  double lowest = 0, highest = 0;  ///< levels
  struct Mean {
    size_t n = 0;  ///< pairs
    double lowest = 0, highest = 0;
  };
  Mean Et_m;  ///< over all estimated pairs; n: those at the highest level
  size_t n_lowest = 0;
  std::optional<Mean> common_Et_m;  ///< over pairs estimated at both levels; absent if not known

  std::string reason() const;
};

/// Curves whose mean E_t at the highest level is lower than least_fall times that at the lowest level.
inline constexpr double least_fall = 0.95;
std::vector<FallingError> falling_errors(const std::vector<NoiseSweep>& sweeps);

Table falling_error_table(const std::vector<FallingError>& rows);

}  // namespace sextant
