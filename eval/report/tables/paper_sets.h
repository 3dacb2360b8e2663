#pragma once

// The paper's three sets of frames and the data that can stand for them.

#include <map>
#include <string>
#include <vector>

#include "sextant/eval/report/tables/published_rows.h"

namespace sextant {

/// One set on one kind of data.
struct SetData {
  std::string set;  ///< the paper's name: "S18-F124-134"
  RecordFilter filter;
};

/// All that are known, the paper's own data first.
const std::vector<SetData>& set_data();

/// "S18-F124-134" -> its frames on the data that `filter` names: "replay of ..., frames 124-134".
std::string set_data_title(const RecordFilter& filter);

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
/// distance, over all objects with truth that move. A set with a single moving object calls it "Obj1" too.
std::map<std::string, RecordRefs> paper_bodies(const RecordRefs& records);

}  // namespace sextant
