#pragma once

// Run times per frame pair, from the records of the parts that were timed on one thread.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/report/evidence.h"

namespace sextant {

inline constexpr const char* frame_stage = "frame";  ///< extraction + camera + objects

struct RunTimes {
  std::string data, estimator, part;
  std::map<std::string, std::vector<double>> by_stage;  ///< ms, one value a frame pair
};

std::vector<RunTimes> run_times(const Evidence& evidence);

}  // namespace sextant
