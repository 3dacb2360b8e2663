#pragma once

// Records of the paper's sets of frames, grouped like the paper's tables.

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {

/// A body with the paper's number: the camera is 0, objects are 1, 2, .. by mean true distance.
struct PaperBody {
  size_t number = 0;
  int id = 0;  ///< 0 for the camera
  RecordRefs records;
};
/// Groups the records of all objects with truth; the camera comes first if there is any.
std::vector<PaperBody> bodies_by_distance(const RecordRefs& records);

RecordRefs matching(const std::vector<Record>& records, const RecordFilter& filter);
std::map<std::string, RecordRefs> by_estimator(const RecordRefs& records);

/// Groups estimated records with truth by the paper's name of the body: "Ego", then "Obj1", "Obj2", .. by
/// true distance of all moving objects with truth.
std::map<std::string, RecordRefs> paper_bodies(const RecordRefs& records);
/// Returns the key in paper_bodies() of a printed name: "Obj" of a set with a single object is "Obj1".
std::string paper_body(const std::string& printed);

// ---- Run times per frame pair, from the records of the experiments that were timed on one thread.

inline constexpr const char* frame_stage = "frame";  ///< extraction + camera + objects

struct RunTimes {
  std::string data, estimator, part;
  std::map<std::string, std::vector<double>> by_stage;  ///< ms, one value per frame pair
};

std::vector<RunTimes> run_times(const Evidence& evidence);

/// Times of a frame pair in ms, measured in several rounds, by round (the seed of the records) and frame.
using RoundTimes = std::map<std::pair<uint64_t, int>, double>;

/// Returns the smallest time of every frame over the rounds, since other work on the machine only adds time.
std::vector<double> best_rounds_ms(const RoundTimes& rounds);

}  // namespace sextant
