#pragma once

#include <string>

#include "sextant/eval/records/record.h"

namespace sextant {

/// KITTI's number of a sequence: "0003" of the authors' sample too.
inline std::string kitti_sequence(const Record& record) {
  return record.dataset == "vdo" && record.sequence == "kitti_03_demo" ? "0003" : record.sequence;
}

}  // namespace sextant
