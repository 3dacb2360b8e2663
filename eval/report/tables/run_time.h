#pragma once

// Run times per frame pair, from the records of the parts that were timed on one thread.

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/report/evidence.h"

namespace sextant {

inline constexpr const char* frame_stage = "frame";  ///< extraction + camera + objects

struct RunTimes {
  std::string data, estimator, part;
  std::map<std::string, std::vector<double>> by_stage;  ///< ms, one value a frame pair
};

std::vector<RunTimes> run_times(const Evidence& evidence);

/// ms of a frame pair that was timed in several rounds, by round (the records' seed) and frame.
using RoundTimes = std::map<std::pair<uint64_t, int>, double>;

/// The best round of every frame: other work on the machine only adds.
std::vector<double> best_rounds_ms(const RoundTimes& rounds);

}  // namespace sextant
