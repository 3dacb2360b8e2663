#pragma once

// Sweeps of records made by hand, for tests.

#include <string>
#include <vector>

#include "sextant/eval/report/noise_sweep.h"

namespace sextant {

/// Makes a sweep of these records.
inline NoiseSweep noise_sweep_of(const std::string& parameter, const std::vector<Record>& records) {
  NoiseLevels levels;
  for (const Record& record : records) levels.add(record);
  return {parameter, levels.take(), levels.estimators()};
}

}  // namespace sextant
