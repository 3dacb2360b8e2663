#pragma once

// Records for tests: what must be the same bytes in every run.

#include <string>
#include <vector>

#include "sextant/eval/records/record.h"

namespace sextant {

/// Without times and memory.
inline std::vector<Record> untimed(std::vector<Record> records) {
  for (Record& record : records) record = strip_times(std::move(record));
  return records;
}

}  // namespace sextant
