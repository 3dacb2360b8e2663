#pragma once

// Records for tests.

#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/records/record.h"

namespace sextant {

/// Returns the records without times and memory.
inline std::vector<Record> untimed(std::vector<Record> records) {
  for (Record& record : records) record = strip_times(std::move(record));
  return records;
}

/// Description of a record with truth and an otherwise empty content.
struct RecordOf {
  std::string dataset = "d", sequence = "s", estimator = "e", body = "ego", noise = "none";
  double level = 0;
  uint64_t seed = 0;
  int frame = 1;

  operator Record() const {
    Record r;
    r.dataset = dataset;
    r.sequence = sequence;
    r.estimator = estimator;
    r.noise = noise;
    r.level = level;
    r.seed = seed;
    r.frame = frame;
    r.body = body;
    r.values[r.is_ego() ? "step_gt_m" : "distance_gt_m"] = 1;
    return r;
  }
};

}  // namespace sextant
