#pragma once

// Records of the paper's sets of frames, grouped as the paper counts.

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {

/// A body as the paper counts: the camera is 0, objects 1, 2, .. by their mean true distance.
struct PaperBody {
  size_t number = 0;
  int id = 0;  ///< 0 for the camera
  RecordRefs records;
};
/// Of all objects with truth in these records; the camera first, where it has any.
std::vector<PaperBody> bodies_by_distance(const RecordRefs& records);

RecordRefs matching(const std::vector<Record>& records, const RecordFilter& filter);
std::map<std::string, RecordRefs> by_estimator(const RecordRefs& records);

/// Estimated records with truth, by the paper's name of the body: "Ego", then "Obj1", "Obj2", .. by true
/// distance, over all objects with truth that move.
std::map<std::string, RecordRefs> paper_bodies(const RecordRefs& records);
/// The name there of a body that the paper prints: "Obj" of a set with a single object is "Obj1".
std::string paper_body(const std::string& printed);

// ---- Run times per frame pair, from the records of the parts that were timed on one thread.

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
